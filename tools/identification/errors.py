"""The errors of a recording."""


class RecordingError(ValueError):
    """A recording that cannot be used. The message states the place and the problem."""
