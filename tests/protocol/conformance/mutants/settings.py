"""Wrong tables: S and A, and what power-on sets."""

from decimal import Decimal

from emulator.profiler import Profile
from protocol.messages import Command, Verb
from tests.protocol.conformance.mutants.mutant import Line, Mutant, caught_by, verb_of


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


@caught_by("4.7/5")
class WakesLazy(Mutant):
    """at power-on the acceleration is another"""

    def reset(self, count: int = 0) -> None:
        super().reset(count)
        self._registers = self._registers._replace(acceleration=self._registers.acceleration // 2)


@caught_by("4.6/4")
class TakesNothingForLittle(Mutant):
    """a speed that rounds to nothing is accepted"""

    def _reply(self, command: Line) -> bytes:
        tiny = isinstance(command, Command) and command.value is not None and 0 < command.value < Decimal("1e-9")
        return b"OK\r" if tiny else super()._reply(command)


@caught_by("4.7/3")
class CutsToItsLimit(Mutant):
    """an acceleration above the limit is taken for the limit"""

    def _reply(self, command: Line) -> bytes:
        if isinstance(command, Command) and command.verb is Verb.SET_ACCELERATION and command.value is not None:
            command = Command(command.verb, min(command.value, Decimal(100)))
        return super()._reply(command)
