"""What can go wrong on the wire, as a small tree.

    TableError               the table, or the way to it, did not do its part
    ├── PortError            the port cannot be opened, or has died
    ├── ReplyTimeout         a reply did not come in time
    ├── UnexpectedReply      what came is no answer to what was sent
    ├── CommandRefused       the table answered `ERR n text`
    ├── ArrivalTimeout       the table did not reach its target in time
    └── NotStopped           the table was told to stop, and was not seen to stand

    ProtocolMisuse           this program asked for what the protocol cannot say (a `ValueError`)

A `TableError` may pass when the line or the table is seen to; a `ProtocolMisuse` needs a change of the program.
"""

# ruff: noqa: N818 - named after what happened, so that an except clause reads as a sentence

from protocol.messages import ErrorCode


class TableError(Exception):
    """The table, or the way to it, did not do its part."""


class PortError(TableError):
    """The port cannot be opened, or has died."""


class ReplyTimeout(TableError):
    """A reply did not come in time."""


class UnexpectedReply(TableError):
    """What came is no answer to what was sent."""


class CommandRefused(TableError):
    """The table refused a command, and changed nothing.

    Attributes:
        code: why, in the table's words.
    """

    def __init__(self, message: str, code: ErrorCode) -> None:
        super().__init__(message)
        self.code = code


class ArrivalTimeout(TableError):
    """The table did not reach its target in time.

    Attributes:
        position_deg: where the table stood when it was last read.
    """

    def __init__(self, message: str, position_deg: float) -> None:
        super().__init__(message)
        self.position_deg = position_deg


class NotStopped(TableError):
    """The table was told to stop, and was not seen to stand; the message says what it will do."""


class ProtocolMisuse(ValueError):
    """This program asked for what the protocol cannot say."""
