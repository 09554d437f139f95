"""The errors of the protocol, as a small tree.

    TableError               the table, or the connection to it, failed
    ├── PortError            the port cannot be opened, or failed
    ├── ReplyTimeout         a reply was not received in time
    ├── UnexpectedReply      the received line is not a reply to the command
    ├── CommandRefused       the table answered `ERR n text`
    ├── ArrivalTimeout       the table did not reach its target in time
    └── NotStopped           the table was commanded to stop; standstill was not observed

    ProtocolMisuse           this program requested what the protocol cannot express (a `ValueError`)

A `TableError` may be solved at the line or the table. A `ProtocolMisuse` needs a change of the program.
"""

# ruff: noqa: N818 - names describe the event, so that an except clause reads as a sentence

from protocol.messages import ErrorCode


class TableError(Exception):
    """The table, or the connection to it, failed."""


class PortError(TableError):
    """The port cannot be opened, or failed."""


class ReplyTimeout(TableError):
    """A reply was not received in time."""


class UnexpectedReply(TableError):
    """The received line is not a reply to the command."""


class CommandRefused(TableError):
    """The table refused a command, and changed nothing.

    Attributes:
        code: the reason, as the table's error code.
    """

    def __init__(self, message: str, code: ErrorCode) -> None:
        super().__init__(message)
        self.code = code


class ArrivalTimeout(TableError):
    """The table did not reach its target in time.

    Attributes:
        position_deg: the last position of the table that was read.
    """

    def __init__(self, message: str, position_deg: float) -> None:
        super().__init__(message)
        self.position_deg = position_deg


class NotStopped(TableError):
    """The table was commanded to stop, but standstill was not observed.

    The message states what the table will do.
    """


class ProtocolMisuse(ValueError):
    """This program requested something that the protocol cannot express."""
