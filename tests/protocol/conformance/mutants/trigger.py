"""Wrong tables: the trigger."""

from protocol.messages import Verb
from tests.protocol.conformance.mutants.mutant import Line, Mutant, caught_by, verb_of


@caught_by("6.2/1")
class LatchesLate(Mutant):
    """the latch is a tenth of a second late"""

    def trigger(self, fraction: float = 0.0) -> None:
        self._triggers.add_edge(self.tick + 100, fraction)


@caught_by("6.2/1")
class LatchesForwards(Mutant):
    """it latches in motions forwards only"""

    def trigger(self, fraction: float = 0.0) -> None:
        if self._state.firmware.reference.speed >= 0:
            super().trigger(fraction)


@caught_by("6.2/2")
class LatchesOnce(Mutant):
    """the first trigger is the last"""

    latched = False

    def trigger(self, fraction: float = 0.0) -> None:
        if not self.latched:
            super().trigger(fraction)
        self.latched = True


@caught_by("6.2/2")
class WaitsToBeRead(Mutant):
    """a trigger is passed over until the last one was read"""

    unread = False

    def trigger(self, fraction: float = 0.0) -> None:
        if not self.unread:
            super().trigger(fraction)
        self.unread = True

    def _reply(self, command: Line) -> bytes:
        self.unread = self.unread and verb_of(command) is not Verb.READ_LATCH
        return super()._reply(command)


@caught_by("6.2/2:power-on")
class FollowsUntilTriggered(Mutant):
    """until the first trigger L reads the position"""

    triggered = False

    def trigger(self, fraction: float = 0.0) -> None:
        super().trigger(fraction)
        self.triggered = True

    def _reply(self, command: Line) -> bytes:
        if verb_of(command) is Verb.READ_LATCH and not self.triggered:
            self.trigger()
            self.triggered = False
        return super()._reply(command)


@caught_by("6.2/3")
class SpeaksAtTriggers(Mutant):
    """a trigger is answered"""

    def trigger(self, fraction: float = 0.0) -> None:
        super().trigger(fraction)
        self._serial.write(b"TRIG\r", self.tick)
