"""Wrong tables: a motion from rest, and its end."""

from decimal import Decimal
from math import isqrt

from protocol.messages import Command, Verb
from tests.protocol.conformance.mutants.mutant import MOTIONS, Line, Mutant, Rereads, caught_by, value_of


class Scales(Mutant):
    """Moves with other values of S and A than set."""

    speed_percent = rate_percent = 100

    def scaled(self, command: Command) -> tuple[int, int]:  # noqa: ARG002 - others look at it
        """Return the speed and the acceleration with which it moves."""
        speed, acceleration, _ = self._registers
        return speed * self.speed_percent // 100, acceleration * self.rate_percent // 100

    def _reply(self, command: Line) -> bytes:
        if not isinstance(command, Command) or command.verb not in MOTIONS:
            return super()._reply(command)
        kept = self._registers
        speed, acceleration = self.scaled(command)
        self._registers = kept._replace(speed=speed, acceleration=acceleration)
        reply = super()._reply(command)
        self._registers = kept
        return reply


@caught_by("7.1/1")
class TooFast(Scales):
    """it is a twentieth too fast"""

    says = "top speed"
    speed_percent = 105


@caught_by("7.1/1:backwards")
class LazyBackwards(Scales):
    """in the backward direction it accelerates a seventh less than A"""

    says = "acceleration"
    rate_percent = 85

    def scaled(self, command: Command) -> tuple[int, int]:
        backwards = value_of(command) < (self.position() if command.verb is Verb.MOVE_TO else 0)
        return super().scaled(command) if backwards else self._registers[:2]


@caught_by("7.1/2")
class NoTriangles(Scales):
    """a short motion is a trapezoid too, with a lower speed"""

    def scaled(self, command: Command) -> tuple[int, int]:
        speed, acceleration, _ = self._registers
        way = abs(value_of(command) - (self.target() if command.verb is Verb.MOVE_TO else 0))
        peak = isqrt(acceleration * int(way * 512) << self.bits)
        return max(1, min(speed, peak * 3 // 4)), acceleration


@caught_by("7.1/3")
class SlowClock(Scales):
    """its seconds are 3 % too long"""

    says = "duration"
    speed_percent, rate_percent = 97, 94


@caught_by("7.1/3:triangle")
class LazyTriangles(Scales):
    """it accelerates a sixth less than A"""

    says = "duration"
    rate_percent = 83


@caught_by("7.1/5")
class RoundsTheSpeedUp(Scales):
    """S is rounded up to the next step of its timer, a fifth above"""

    says = "maximum speed"
    speed_percent = 120


@caught_by("7.2/2")
class StopsShort(Rereads):
    """it stops a fifth of a degree short"""

    says = "from the target"
    short_deg = Decimal("0.2")

    def instead(self, command: Command) -> Command:
        if command.verb is Verb.MOVE_BY:
            return command
        way = value_of(command) - self.position()
        short = self.short_deg * ((way > 1) - (way < -1))
        return Command(Verb.MOVE_TO, value_of(command) - short)


class InTwoSteps(StopsShort):
    """Stops beside its target, and then continues to it, with a share of S."""

    second: Command | None = None
    slower = 1

    def instead(self, command: Command) -> Command:
        first = super().instead(command)
        self.second = command if first != command else None
        return first

    def advance(self, ticks: int) -> None:
        super().advance(ticks)
        if self.second is not None and not self.moving:
            Mutant._reply(self, self.second)  # noqa: SLF001 - not to be read otherwise again
            self.rerun(self._registers.speed // self.slower, self._registers.acceleration)
            self.second = None


@caught_by("7.1/4")
class Overshoots(InTwoSteps):
    """it passes its target by a third of a degree, and returns"""

    says = "farthest position"
    short_deg = Decimal("-0.33")


@caught_by("7.2/3")
class CreepsHome(InTwoSteps):
    """the last third of a degree takes it three seconds"""

    says = "settling"
    short_deg = Decimal("0.33")
    slower = 400


@caught_by("7.2/1")
class CreepsOn(InTwoSteps):
    """after a motion it continues to creep"""

    says = "readings at rest range from"
    slower = 200

    def instead(self, command: Command) -> Command:
        self.second = Command(Verb.MOVE_BY, Decimal(1))
        return command


@caught_by("7.2/4")
class Drifts(Rereads):
    """each motion ends a fiftieth of a degree farther on"""

    motions = 0

    def instead(self, command: Command) -> Command:
        self.motions += 1
        if command.verb is Verb.MOVE_BY:
            return command
        return Command(Verb.MOVE_TO, value_of(command) + self.motions * Decimal("0.02"))
