"""Wrong tables: S and A, and what power-on sets."""

from decimal import Decimal

from protocol.messages import Command, Verb
from tests.protocol.conformance.mutants.mutant import MOTIONS, Line, Mutant, caught_by, value_of, verb_of


@caught_by("4.6/2")
class SpeedAtOnce(Mutant):
    """S acts at once on the running motion"""

    def _reply(self, command: Line) -> bytes:
        reply = super()._reply(command)
        if verb_of(command) is Verb.SET_SPEED:
            self.rerun(self._registers.speed, self._loop.state.firmware.profile.acceleration)
        return reply


@caught_by("4.7/2")
class AccelerationAtOnce(Mutant):
    """A acts at once on the running motion"""

    def _reply(self, command: Line) -> bytes:
        reply = super()._reply(command)
        if verb_of(command) is Verb.SET_ACCELERATION:
            self.rerun(self._loop.state.firmware.profile.speed, self._registers.acceleration)
        return reply


class ForgetsAfterAMotion(Mutant):
    """Resets settings to those of power-on once they were used."""

    forgotten = ""

    def _reply(self, command: Line) -> bytes:
        reply = super()._reply(command)
        if verb_of(command) in MOTIONS:
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


class WholeNumbers(Mutant):
    """Drops the decimals of a setting."""

    verb = Verb.SET_SPEED

    def _reply(self, command: Line) -> bytes:
        if isinstance(command, Command) and command.verb is self.verb:
            command = Command(command.verb, value_of(command) // 1)
        return super()._reply(command)


@caught_by("4.6/1")
class WholeSpeeds(WholeNumbers):
    """S has no decimals"""


@caught_by("4.7/1")
class WholeAccelerations(WholeNumbers):
    """A has no decimals"""

    verb = Verb.SET_ACCELERATION


@caught_by("4.6/1:reconnect")
class ResetsForANewClient(Mutant):
    """a client that opens the port resets S and A"""

    def disconnect(self) -> None:
        super().disconnect()
        self._registers = self._interpreter.power_on()._replace(latched_count=self._registers.latched_count)


class WakesOtherwise(Mutant):
    """Starts with half of the value of a setting."""

    halved = ""

    def reset(self, count: int = 0) -> None:
        super().reset(count)
        self._registers = self._registers._replace(**{self.halved: getattr(self._registers, self.halved) // 2})


@caught_by("4.6/5")
class WakesSlow(WakesOtherwise):
    """at power-on the speed is another"""

    halved = "speed"


@caught_by("4.7/5")
class WakesLazy(WakesOtherwise):
    """at power-on the acceleration is another"""

    halved = "acceleration"


@caught_by("6.1/5")
class KeepsItsCount(Mutant):
    """the position is kept without power"""

    def reset(self, count: int = 0) -> None:
        super().reset(count or self._loop.state.firmware.counts[-1])


class TakesNothingForLittle(Mutant):
    """Accepts a setting that rounds to nothing."""

    verb = Verb.SET_SPEED

    def _reply(self, command: Line) -> bytes:
        tiny = isinstance(command, Command) and command.verb is self.verb and 0 < value_of(command) < Decimal("1e-9")
        return b"OK\r" if tiny else super()._reply(command)


@caught_by("4.6/4")
class TakesNoSpeedForLittle(TakesNothingForLittle):
    """a speed that rounds to nothing is accepted"""


@caught_by("4.7/4")
class TakesNoAccelerationForLittle(TakesNothingForLittle):
    """an acceleration that rounds to nothing is accepted"""

    verb = Verb.SET_ACCELERATION


@caught_by("4.7/3")
class CutsToItsLimit(Mutant):
    """an acceleration above the limit is taken for the limit"""

    def _reply(self, command: Line) -> bytes:
        if isinstance(command, Command) and command.verb is Verb.SET_ACCELERATION:
            command = Command(command.verb, min(value_of(command), Decimal(100)))
        return super()._reply(command)


class LostInMotion(Mutant):
    """Sends `OK` to a setting during a motion, and keeps the old one."""

    verb = Verb.SET_SPEED

    def _reply(self, command: Line) -> bytes:
        return b"OK\r" if self.moving and verb_of(command) is self.verb else super()._reply(command)


@caught_by("4.1/11:random")
class SpeedIsLostInMotion(LostInMotion):
    """S is lost in a motion"""


@caught_by("4.1/11:random")
class AccelerationIsLostInMotion(LostInMotion):
    """A is lost in a motion"""

    verb = Verb.SET_ACCELERATION
