"""What can go wrong with the compiled firmware beside the table that it controls."""


class ToolchainError(Exception):
    """The firmware cannot be built or run on this machine, or is for another table.

    The message states the next step.
    """


class ChipError(Exception):
    """The simulated controller stopped. The message states the reason."""
