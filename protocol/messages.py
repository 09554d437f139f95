"""The messages of the protocol: commands, replies, and the table of the verbs (Table 1 of the paper).

Numbers are decimal, as in the protocol, so that rounding is exact.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from decimal import Decimal
from enum import IntEnum, StrEnum
from types import MappingProxyType

LINE_LIMIT = 32
"""The maximum length of a line, in bytes, without its CR."""


class Verb(StrEnum):
    """The letter that begins a command."""

    READ_POSITION = "H"
    READ_LATCH = "L"
    MOVE_TO = "P"
    MOVE_BY = "R"
    SET_SPEED = "S"
    SET_ACCELERATION = "A"


class ErrorCode(IntEnum):
    """Why the table refused a line."""

    UNKNOWN_COMMAND = 1
    BAD_NUMBER = 2
    OUT_OF_RANGE = 3
    LINE_TOO_LONG = 4
    BAD_BYTE = 5

    @property
    def text(self) -> str:
        """The text after the code in the reply."""
        return self.name.lower().replace("_", " ")


@dataclass(frozen=True, slots=True)
class Command:
    """One line to the table. `value` is in the verb's unit, and None for a verb without a number."""

    verb: Verb
    value: Decimal | None = None


@dataclass(frozen=True, slots=True)
class Angle:
    """The reply to a verb that reads a register: an angle of the unwrapped axis."""

    verb: Verb
    angle_deg: Decimal


@dataclass(frozen=True, slots=True)
class Ok:
    """The reply to an accepted command: accepted, not arrived."""


@dataclass(frozen=True, slots=True)
class Refusal:
    """The reply to a refused line, which had no effect."""

    code: ErrorCode


Reply = Angle | Ok | Refusal


@dataclass(frozen=True, slots=True)
class VerbEntry:
    """One row of Table 1: the number's unit (None: no number), the kind of reply, and the meaning."""

    unit: str | None
    reply: type[Angle] | type[Ok]
    meaning: str

    @property
    def takes_number(self) -> bool:
        """Whether the verb takes exactly one number; else it takes none."""
        return self.unit is not None


VERBS: Mapping[Verb, VerbEntry] = MappingProxyType(
    {
        Verb.READ_POSITION: VerbEntry(None, Angle, "read the present position from the encoder"),
        Verb.READ_LATCH: VerbEntry(None, Angle, "read the position latched by the probe's trigger"),
        Verb.MOVE_TO: VerbEntry("deg", Ok, "move to a position"),
        Verb.MOVE_BY: VerbEntry("deg", Ok, "move by an increment"),
        Verb.SET_SPEED: VerbEntry("deg/s", Ok, "set the top speed of the next motion"),
        Verb.SET_ACCELERATION: VerbEntry("deg/s2", Ok, "set the acceleration of the next motion"),
    }
)
"""Table 1 of the paper, in its order."""

ANGLE_LETTERS = "".join(verb for verb, entry in VERBS.items() if entry.reply is Angle)
"""The letters that begin a reply with an angle."""
