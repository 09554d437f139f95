"""What a deliberately wrong table is made of, and the register of all of them."""

from collections.abc import Callable
from decimal import Decimal

from emulator.config import TableConfig, load_config
from emulator.firmware import MOVING, SETTLING
from emulator.fixed_point import POSITION_BITS
from emulator.protocol_emulator import Serial
from emulator.table import Table
from protocol.messages import Command, ErrorCode, Verb

Line = Command | ErrorCode


def port_to(kind: type[Table], config: TableConfig | None = None) -> Serial:
    """Return a port in virtual time to a table of this kind."""
    port = Serial("emulator://", timeout=1)
    port.table = kind(config or load_config())
    return port


def verb_of(line: Line) -> Verb | None:
    return line.verb if isinstance(line, Command) else None


class Mutant(Table):
    """Short ways to the table's inside."""

    @property
    def moving(self) -> bool:
        return self._state.firmware.motion in {MOVING, SETTLING}

    def position(self) -> Decimal:
        return self._interpreter.angle_deg(self._state.firmware.counts[-1])

    def target(self) -> Decimal:
        reference = self._state.firmware.reference
        fixed = (reference.position_count + reference.distance_count << POSITION_BITS) + reference.fraction
        return Decimal(fixed + reference.distance_fraction) / (1 << POSITION_BITS) / 512


MUTANTS: dict[str, tuple[str, type[Mutant]]] = {}
"""By what is wrong: the case that catches it, and the table."""


def caught_by(case: str) -> Callable[[type[Mutant]], type[Mutant]]:
    def register(kind: type[Mutant]) -> type[Mutant]:
        assert kind.__doc__
        MUTANTS[kind.__doc__] = (case, kind)
        return kind

    return register
