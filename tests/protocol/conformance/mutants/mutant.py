"""The parts of deliberately wrong tables, and the register of all of them."""

from collections.abc import Callable
from decimal import Decimal

from emulator.config.table_config import TableConfig, load_config
from emulator.firmware.controller import MOVING, SETTLING
from emulator.firmware.profiler import Profile
from emulator.protocol_emulator import Serial
from emulator.table.table import Table
from protocol.messages import Command, ErrorCode, Verb

Line = Command | ErrorCode

MOTIONS = {Verb.MOVE_TO, Verb.MOVE_BY}


def port_to(kind: type[Table], config: TableConfig | None = None) -> Serial:
    """Return a port in virtual time to a table of this kind."""
    port = Serial("emulator://", timeout=1)
    port.table = kind(config or load_config())
    return port


def verb_of(line: Line) -> Verb | None:
    return line.verb if isinstance(line, Command) else None


def value_of(command: Command) -> Decimal:
    assert command.value is not None
    return command.value


class Mutant(Table):
    """Short names for the table's internals."""

    says = ""
    """Words of the case for the error."""

    @property
    def moving(self) -> bool:
        return self._loop.state.firmware.motion in {MOVING, SETTLING}

    @property
    def bits(self) -> int:
        """Fraction bits of position and speed."""
        return self.config.motion_bits

    def position(self) -> Decimal:
        return self._interpreter.angle_deg(self._loop.state.firmware.counts[-1])

    def target(self) -> Decimal:
        reference = self._loop.state.firmware.reference
        fixed = (reference.position_count + reference.distance_count << self.bits) + reference.fraction
        return Decimal(fixed + reference.distance_fraction) / (1 << self.bits) / 512

    def braking_way(self) -> Decimal:
        """Remaining travel of the reference if it brakes now with the acceleration of its motion."""
        speed, acceleration = self._loop.state.firmware.reference.speed, self._loop.state.firmware.profile.acceleration
        return Decimal(speed * abs(speed) // (2 * acceleration)) / (1 << self.bits) / 512

    def rerun(self, speed: int, acceleration: int) -> None:
        """Give the running motion another profile."""
        controller = self._loop.state.firmware
        self._loop.state = self._loop.state._replace(
            firmware=controller._replace(profile=Profile.of(speed, acceleration))
        )

    def step_to(self, speed: int) -> None:
        """Change the speed of the reference at once."""
        controller = self._loop.state.firmware
        stepped = controller._replace(reference=controller.reference._replace(speed=speed))
        self._loop.state = self._loop.state._replace(firmware=stepped)


class RereadsLines(Mutant):
    """Reads a line as another one."""

    def instead_of(self, line: bytes) -> bytes:
        raise NotImplementedError

    def _answer(self, line: bytes | ErrorCode) -> bytes:
        return super()._answer(line if isinstance(line, ErrorCode) else self.instead_of(line))


class RereadsNumbers(Mutant):
    """Reads the number of some commands as another one."""

    verbs = frozenset({Verb.MOVE_TO, Verb.MOVE_BY, Verb.SET_SPEED, Verb.SET_ACCELERATION})

    def number_instead_of(self, value: Decimal) -> Decimal:
        raise NotImplementedError

    def _reply(self, command: Line) -> bytes:
        if isinstance(command, Command) and command.value is not None and command.verb in self.verbs:
            command = Command(command.verb, self.number_instead_of(command.value))
        return super()._reply(command)


class Rereads(Mutant):
    """Executes a motion command as another one, or sends `OK` and ignores it."""

    def instead(self, command: Command) -> Command | None:
        raise NotImplementedError

    def _reply(self, command: Line) -> bytes:
        if isinstance(command, Command) and command.verb in MOTIONS:
            changed = self.instead(command)
            return b"OK\r" if changed is None else super()._reply(changed)
        return super()._reply(command)


MUTANTS: dict[str, tuple[str, type[Mutant]]] = {}
"""By error: the case that detects it, and the table."""


def caught_by(case: str) -> Callable[[type[Mutant]], type[Mutant]]:
    """Register a wrong table with the id of the case that must detect it."""

    def register(kind: type[Mutant]) -> type[Mutant]:
        assert kind.__doc__
        assert kind.__doc__ not in MUTANTS
        MUTANTS[kind.__doc__] = (case, kind)
        return kind

    return register
