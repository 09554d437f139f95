"""Deliberately wrong tables: each breaks one rule, and names the case that is there to catch it."""

import re
from collections.abc import Callable
from decimal import ROUND_DOWN, ROUND_HALF_UP, Decimal

from emulator.config import TableConfig, load_config
from emulator.firmware import IDLE, MOVING, SETTLING
from emulator.fixed_point import POSITION_BITS
from emulator.profiler import Profile
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


# The serial line and lines


@caught_by("2.1/3")
class HonoursXoff(Mutant):
    """XOFF silences it"""

    deaf = False

    def receive(self, data: bytes) -> None:
        self.deaf = self.deaf or b"\x13" in data
        if not self.deaf:
            super().receive(data)


@caught_by("2.2/2")
class AnswersAfterTheMotion(Mutant):
    """replies wait for the end of the motion"""

    def transmit(self) -> bytes:
        return b"" if self.moving else super().transmit()


@caught_by("2.3/1")
class SmallBuffer(Mutant):
    """the buffer holds 32 bytes"""

    def receive(self, data: bytes) -> None:
        super().receive(data[:32])


@caught_by("3.1/1")
class NeedsNoCr(Mutant):
    """a letter is answered without its CR"""

    def receive(self, data: bytes) -> None:
        super().receive(b"H\r" if data == b"H" else data)


@caught_by("3.1/2")
class LfEndsALine(Mutant):
    """LF ends a line"""

    def receive(self, data: bytes) -> None:
        super().receive(data.replace(b"\n", b"\r"))


@caught_by("3.1/3")
class AnswersEmptyLines(Mutant):
    """an empty line is an unknown command"""

    def receive(self, data: bytes) -> None:
        super().receive(data.replace(b"\r\r", b"\r?\r"))


@caught_by("3.1/5")
class KeepsHalfLines(Mutant):
    """the half line of a client that left meets the next one"""

    def disconnect(self) -> None:
        self._serial.uart.disconnect()


@caught_by("3.2/2")
class CutsLongLines(Mutant):
    """a long line is cut, and its beginning carried out"""

    def receive(self, data: bytes) -> None:
        super().receive(b"\r".join(line[:32] for line in data.split(b"\r")))


@caught_by("3.2/3")
class IgnoresBadBytes(Mutant):
    """bad bytes are passed over"""

    def receive(self, data: bytes) -> None:
        super().receive(bytes(byte for byte in data if 0x20 <= byte < 0x7F or byte in b"\r\n"))


# Grammar


@caught_by("4.1/1")
class TakesLowerCase(Mutant):
    """lower case is as good"""

    def receive(self, data: bytes) -> None:
        super().receive(data.upper())


@caught_by("4.1/4")
class TakesTheFirstNumber(Mutant):
    """of two numbers the first is taken"""

    def receive(self, data: bytes) -> None:
        super().receive(re.sub(rb"([PRSA] [0-9.]+) [0-9. ]+\r", rb"\1\r", data))


@caught_by("4.1/7")
class TakesExponents(Mutant):
    """numbers are read as a programming language reads them"""

    def receive(self, data: bytes) -> None:
        super().receive(re.sub(rb"1e4\r", b"10000\r", data))


@caught_by("4.1/8")
class OneDecimal(Mutant):
    """decimals after the first are dropped"""

    def receive(self, data: bytes) -> None:
        super().receive(re.sub(rb"(\.[0-9])[0-9]+", rb"\1", data))


@caught_by("4.1/10")
class StopsWhenItRefuses(Mutant):
    """a refused line stops the motion"""

    def _reply(self, command: Line) -> bytes:
        reply = super()._reply(command)
        if reply.startswith(b"ERR"):
            super()._reply(Command(Verb.MOVE_BY, Decimal(0)))
        return reply


@caught_by("4.6/3")
class SaysOkFirst(Mutant):
    """OK comes before the number is looked at"""

    def _reply(self, command: Line) -> bytes:
        reply = super()._reply(command)
        return b"OK\r" if isinstance(command, Command) and reply.startswith(b"ERR") else reply


# Readings


@caught_by("4.2/2")
class StalePosition(Mutant):
    """the position is looked up ten times a second"""

    last = (-100, b"")

    def _reply(self, command: Line) -> bytes:
        if verb_of(command) is Verb.READ_POSITION:
            if self.tick - self.last[0] >= 100:
                self.last = self.tick, super()._reply(command)
            return self.last[1]
        return super()._reply(command)


@caught_by("4.2/3")
class Modulo360(Mutant):
    """the position is told modulo 360"""

    def _reply(self, command: Line) -> bytes:
        if verb_of(command) is Verb.READ_POSITION:
            return b"H %.1f\r" % (float(self.position()) % 360)
        return super()._reply(command)


@caught_by("4.3/2")
class ReadingClearsTheLatch(Mutant):
    """reading clears the latch"""

    def _reply(self, command: Line) -> bytes:
        reply = super()._reply(command)
        if verb_of(command) is Verb.READ_LATCH:
            self._registers = self._registers._replace(latched_count=0)
        return reply


@caught_by("6.1/1")
class LatchIsThePosition(Mutant):
    """L reads the position"""

    def _reply(self, command: Line) -> bytes:
        if verb_of(command) is Verb.READ_LATCH:
            return super()._reply(Command(Verb.READ_POSITION)).replace(b"H", b"L")
        return super()._reply(command)


class Renders(Mutant):
    """Tells angles in another form."""

    def form(self, angle: Decimal) -> str:
        raise NotImplementedError

    def _reply(self, command: Line) -> bytes:
        reply = super()._reply(command)
        if reply[:2] not in {b"H ", b"L "}:
            return reply
        count = self._state.firmware.counts[-1] if reply[:1] == b"H" else self._registers.latched_count
        return reply[:2] + self.form(Decimal(count) / 512).encode() + b"\r"


@caught_by("5.2/5")
class MinusZero(Renders):
    """-0.0"""

    def form(self, angle: Decimal) -> str:
        return f"{float(angle):.1f}"


@caught_by("5.2/3")
class Truncates(Renders):
    """angles are cut, not rounded"""

    def form(self, angle: Decimal) -> str:
        return str(angle.quantize(Decimal("0.1"), ROUND_DOWN) + 0)


@caught_by("5.2/4")
class HalvesAwayFromZero(Renders):
    """halves are rounded away from zero"""

    def form(self, angle: Decimal) -> str:
        return str(angle.quantize(Decimal("0.1"), ROUND_HALF_UP) + 0)


@caught_by("5.2/2")
class TwoDecimals(Renders):
    """two decimals"""

    def form(self, angle: Decimal) -> str:
        return str(angle.quantize(Decimal("0.01")) + 0)


@caught_by("5.2/6")
class LeadingZeros(Renders):
    """leading zeros"""

    def form(self, angle: Decimal) -> str:
        return f"{angle.quantize(Decimal('0.1')) + 0:07}"


# Replies


@caught_by("5.1/2")
class SwapsRepliesUnderLoad(Mutant):
    """under load replies change places"""

    held = b""

    def _reply(self, command: Line) -> bytes:
        reply = super()._reply(command)
        busy = self._serial.uart.waiting_count > 8
        if busy and not self.held:
            self.held = reply
            return b""
        reply, self.held = reply + self.held, b""
        return reply


@caught_by("5.1/1")
class AnswersTwice(Mutant):
    """R is answered twice"""

    def _reply(self, command: Line) -> bytes:
        return super()._reply(command) * (1 + (verb_of(command) is Verb.MOVE_BY))


@caught_by("5.1/3")
class AnnouncesArrival(Mutant):
    """the end of a motion is announced"""

    was_moving = False

    def advance(self, ticks: int) -> None:
        super().advance(ticks)
        if self.was_moving and self._state.firmware.motion == IDLE:
            self._serial.write(b"DONE\r", self.tick)
        self.was_moving = self.moving


@caught_by("5.1/4")
class AnswersCrLf(Mutant):
    """replies end in CR LF"""

    def _reply(self, command: Line) -> bytes:
        return super()._reply(command) + b"\n"


@caught_by("5.3/2")
class OtherWords(Mutant):
    """a refusal has other words"""

    def _reply(self, command: Line) -> bytes:
        return super()._reply(command).replace(b"bad number", b"syntax error")


# Settings


class Resettles(Mutant):
    """Gives the running motion another profile."""

    def rerun(self, speed: int, acceleration: int) -> None:
        controller = self._state.firmware
        self._state = self._state._replace(firmware=controller._replace(profile=Profile.of(speed, acceleration)))


@caught_by("4.6/2")
class SpeedAtOnce(Resettles):
    """S acts at once on the running motion"""

    def _reply(self, command: Line) -> bytes:
        reply = super()._reply(command)
        if verb_of(command) is Verb.SET_SPEED:
            self.rerun(self._registers.speed, self._state.firmware.profile.acceleration)
        return reply


@caught_by("4.7/2")
class AccelerationAtOnce(Resettles):
    """A acts at once on the running motion"""

    def _reply(self, command: Line) -> bytes:
        reply = super()._reply(command)
        if verb_of(command) is Verb.SET_ACCELERATION:
            self.rerun(self._state.firmware.profile.speed, self._registers.acceleration)
        return reply


class ForgetsAfterAMotion(Mutant):
    """Puts settings back to those of power-on once they were used."""

    forgotten = ""

    def _reply(self, command: Line) -> bytes:
        reply = super()._reply(command)
        if verb_of(command) in {Verb.MOVE_TO, Verb.MOVE_BY}:
            fresh = self._interpreter.power_on()
            self._registers = self._registers._replace(**{self.forgotten: getattr(fresh, self.forgotten)})
        return reply


@caught_by("4.6/1")
class ForgetsTheSpeed(ForgetsAfterAMotion):
    """S holds for one motion only"""

    forgotten = "speed"


@caught_by("4.7/1")
class ForgetsTheAcceleration(ForgetsAfterAMotion):
    """A holds for one motion only"""

    forgotten = "acceleration"


class WakesOtherwise(Mutant):
    """Wakes with other settings."""

    def reset(self, count: int = 0) -> None:
        super().reset(count)
        self._registers = self._registers._replace(speed=self._registers.speed // 2)


@caught_by("4.6/5")
class WakesSlow(WakesOtherwise):
    """at power-on the speed is another"""


@caught_by("6.1/5")
class KeepsItsCount(Mutant):
    """the position outlives the power"""

    def reset(self, count: int = 0) -> None:
        super().reset(count or self._state.firmware.counts[-1])


# Motion


class Rereads(Mutant):
    """Carries a motion command out as another one."""

    def instead(self, command: Command) -> Command | None:
        raise NotImplementedError

    def _reply(self, command: Line) -> bytes:
        if isinstance(command, Command) and command.verb in {Verb.MOVE_TO, Verb.MOVE_BY}:
            changed = self.instead(command)
            return b"OK\r" if changed is None else super()._reply(changed)
        return super()._reply(command)


def value_of(command: Command) -> Decimal:
    assert command.value is not None
    return command.value


@caught_by("4.4/1")
class ShortWayRound(Rereads):
    """P takes the short way round"""

    def instead(self, command: Command) -> Command:
        if command.verb is Verb.MOVE_BY:
            return command
        turns = round((value_of(command) - self.position()) / 360)
        return Command(Verb.MOVE_TO, value_of(command) - 360 * turns)


@caught_by("4.5/1")
class IncrementFromTheOldTarget(Rereads):
    """R counts from the old target"""

    def instead(self, command: Command) -> Command:
        return Command(Verb.MOVE_TO, self.target() + value_of(command)) if command.verb is Verb.MOVE_BY else command


@caught_by("4.5/2")
class IncrementFromTheDisplay(Rereads):
    """R counts from the position as it is told"""

    def instead(self, command: Command) -> Command:
        if command.verb is Verb.MOVE_TO:
            return command
        return Command(Verb.MOVE_TO, round(self.position(), 1) + value_of(command))


@caught_by("4.5/3")
class IgnoresNothing(Rereads):
    """R 0 is passed over as nothing to do"""

    def instead(self, command: Command) -> Command | None:
        return None if command.verb is Verb.MOVE_BY and value_of(command) == 0 else command


@caught_by("7.3/1")
class FinishesFirst(Rereads):
    """a target that comes in a motion is passed over"""

    def instead(self, command: Command) -> Command | None:
        return None if self.moving and command.verb is Verb.MOVE_TO else command


@caught_by("7.3/2")
class StepsAtPreemption(Rereads):
    """at a new target the reference's speed steps to 0"""

    def instead(self, command: Command) -> Command:
        controller = self._state.firmware
        standing = controller._replace(reference=controller.reference._replace(speed=0))
        self._state = self._state._replace(firmware=standing)
        return command


@caught_by("7.3/4")
class StepsToALowerSpeed(Resettles):
    """a lower S is taken in one step"""

    def _reply(self, command: Line) -> bytes:
        reply = super()._reply(command)
        if verb_of(command) is Verb.MOVE_TO:
            controller, top = self._state.firmware, self._registers.speed
            slowed = controller.reference._replace(speed=max(-top, min(top, controller.reference.speed)))
            self._state = self._state._replace(firmware=controller._replace(reference=slowed))
        return reply


@caught_by("7.3/5")
class KeepsTheOldAcceleration(Resettles):
    """a new A waits until the table rests"""

    def _reply(self, command: Line) -> bytes:
        before, was_moving = self._state.firmware.profile.acceleration, self.moving
        reply = super()._reply(command)
        if was_moving and verb_of(command) is Verb.MOVE_TO:
            self.rerun(self._registers.speed, before)
        return reply


@caught_by("7.3/7")
class QueuesMotions(Rereads):
    """motions are carried out one after the other"""

    queue: tuple[Command, ...] = ()

    def instead(self, command: Command) -> Command | None:
        if self.moving:
            self.queue += (command,)
            return None
        return command

    def advance(self, ticks: int) -> None:
        super().advance(ticks)
        if self.queue and not self.moving:
            first, *rest = self.queue
            self.queue = tuple(rest)
            self._reply(first)


@caught_by("7.1/1")
class TooFast(Rereads):
    """it is a twentieth too fast"""

    def instead(self, command: Command) -> Command:
        self._registers = self._registers._replace(speed=self._registers.speed * 105 // 100)
        return command

    def _reply(self, command: Line) -> bytes:
        speed = self._registers.speed
        reply = super()._reply(command)
        if verb_of(command) in {Verb.MOVE_TO, Verb.MOVE_BY}:
            self._registers = self._registers._replace(speed=speed)
        return reply


@caught_by("7.1/3")
class LazyTriangles(Rereads):
    """it accelerates a sixth less than A"""

    def _reply(self, command: Line) -> bytes:
        rate = self._registers.acceleration
        if verb_of(command) in {Verb.MOVE_TO, Verb.MOVE_BY}:
            self._registers = self._registers._replace(acceleration=rate * 5 // 6)
        reply = super()._reply(command)
        if verb_of(command) in {Verb.MOVE_TO, Verb.MOVE_BY}:
            self._registers = self._registers._replace(acceleration=rate)
        return reply

    def instead(self, command: Command) -> Command:
        return command


@caught_by("7.2/2")
class StopsShort(Rereads):
    """it stops a fifth of a degree short"""

    def instead(self, command: Command) -> Command:
        if command.verb is Verb.MOVE_BY:
            return command
        way = value_of(command) - self.position()
        short = Decimal("0.2") if way > 1 else Decimal("-0.2") if way < -1 else Decimal(0)
        return Command(Verb.MOVE_TO, value_of(command) - short)


@caught_by("6.1/3")
class StopsAtTheEndOfTheCounter(Rereads):
    """at the end of the counter it stops"""

    def instead(self, command: Command) -> Command | None:
        beyond = abs(self._state.firmware.counts[-1] + int(value_of(command) * 512)) >= 2**31
        return None if command.verb is Verb.MOVE_BY and beyond else command


# The trigger


@caught_by("6.2/1")
class LatchesLate(Mutant):
    """the latch is a tenth of a second late"""

    def trigger(self, fraction: float = 0.0) -> None:
        self._triggers.add_edge(self.tick + 100, fraction)


@caught_by("6.2/2")
class LatchesOnce(Mutant):
    """the first trigger is the last"""

    latched = False

    def trigger(self, fraction: float = 0.0) -> None:
        if not self.latched:
            super().trigger(fraction)
        self.latched = True


@caught_by("6.2/3")
class SpeaksAtTriggers(Mutant):
    """a trigger is answered"""

    def trigger(self, fraction: float = 0.0) -> None:
        super().trigger(fraction)
        self._serial.write(b"TRIG\r", self.tick)


# Recovery


@caught_by("8.3/1")
class CancelIsIgnored(Mutant):
    """CAN is passed over, and the half line carried out"""

    def receive(self, data: bytes) -> None:
        super().receive(data.replace(b"\x18", b""))
