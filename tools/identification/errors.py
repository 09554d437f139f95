"""What can be wrong with a recording."""


class RecordingError(ValueError):
    """A recording that cannot be used; the message names the place and what is wrong with it."""
