"""The serial protocol between a client and the rotary table."""

import protocol.program.quiet_start  # noqa: F401 - first, see there

# isort: split

from protocol.client import TableClient
from protocol.clock import Clock, WallClock
from protocol.codec import decode_command, decode_reply, encode_command, encode_reply
from protocol.errors import (
    ArrivalTimeout,
    CommandRefused,
    NotStopped,
    PortError,
    ProtocolMisuse,
    ReplyTimeout,
    TableError,
    UnexpectedReply,
)
from protocol.line_buffer import LineBuffer
from protocol.messages import VERBS, Angle, Command, ErrorCode, Ok, Refusal, Reply, Verb
from protocol.port import Port

__all__ = [
    "VERBS",
    "Angle",
    "ArrivalTimeout",
    "Clock",
    "Command",
    "CommandRefused",
    "ErrorCode",
    "LineBuffer",
    "NotStopped",
    "Ok",
    "Port",
    "PortError",
    "ProtocolMisuse",
    "Refusal",
    "Reply",
    "ReplyTimeout",
    "TableClient",
    "TableError",
    "UnexpectedReply",
    "Verb",
    "WallClock",
    "decode_command",
    "decode_reply",
    "encode_command",
    "encode_reply",
]
