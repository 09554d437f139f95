"""What can go wrong with the compiled firmware beside the table that it controls."""


class ToolchainError(Exception):
    """The firmware cannot be built or run on this machine, or is for another table; the message says what to do."""


class ChipError(Exception):
    """The simulated controller stopped; the message says why."""
