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
    """it latches only in forward motions"""

    def trigger(self, fraction: float = 0.0) -> None:
        if self._loop.state.firmware.reference.speed >= 0:
            super().trigger(fraction)


@caught_by("6.2/2")
class LatchesOnce(Mutant):
    """the first trigger is the only one"""

    latched = False

    def trigger(self, fraction: float = 0.0) -> None:
        if not self.latched:
            super().trigger(fraction)
        self.latched = True


@caught_by("6.2/2")
class WaitsToBeRead(Mutant):
    """a trigger is ignored until the last one was read"""

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
    """a trigger has a reply"""

    def trigger(self, fraction: float = 0.0) -> None:
        super().trigger(fraction)
        self._serial.write(b"TRIG\r", self.tick)


class LosesEdges(Mutant):
    """Ignores an edge."""

    def is_lost(self) -> bool:
        raise NotImplementedError

    def trigger(self, fraction: float = 0.0) -> None:
        if not self.is_lost():
            super().trigger(fraction)


@caught_by("6.2/1")
class LosesEdgesWhileBusy(LosesEdges):
    """an edge that comes while a byte is on the line is lost"""

    def is_lost(self) -> bool:
        return not self._serial.uart.idle


@caught_by("6.2/2")
class LosesEdgesAtRestWhileBusy(LosesEdges):
    """at rest an edge that comes while a byte is on the line is lost"""

    def is_lost(self) -> bool:
        return not self._serial.uart.idle and not self.moving


@caught_by("6.2/1")
class LosesEdgesWhileReceiving(LosesEdges):
    """an edge that comes while a command comes in is lost"""

    def is_lost(self) -> bool:
        return self._serial.uart.waiting_count > 0


@caught_by("6.2/1")
class LosesEdgesWhileReplying(LosesEdges):
    """an edge that comes while a reply goes out is lost"""

    def is_lost(self) -> bool:
        return self._serial.uart.transmit_count > 0


def debounces(within_ms: int, case: str) -> None:
    class DebouncesEdges(LosesEdges):
        __doc__ = f"an edge within {within_ms} ms of another is taken for its bounce"

        last_tick = -100

        def is_lost(self) -> bool:
            since, self.last_tick = self.tick - self.last_tick, self.tick
            return since < within_ms

    caught_by(case)(DebouncesEdges)


debounces(25, "6.2/2")
debounces(2, "6.2/1:instant")


@caught_by("6.2/1:instant")
class LatchesATickLate(Mutant):
    """the latch is a tick late"""

    def trigger(self, fraction: float = 0.0) -> None:
        self._triggers.add_edge(self.tick + 1, fraction)


@caught_by("6.2/1:instant")
class LatchesHalfATickLate(Mutant):
    """the latch is half a tick late"""

    def trigger(self, fraction: float = 0.0) -> None:
        late = fraction + 0.5
        self._triggers.add_edge(self.tick + int(late), late % 1)


@caught_by("6.2/1:instant")
class LatchesTheTicksCount(Mutant):
    """the latch is the count at the beginning of the tick"""

    def _see_edge(self, angle_rad: float) -> None:  # noqa: ARG002 - that is what is wrong
        self._registers = self._registers._replace(latched_count=self._loop.state.firmware.counts[-2])


def torn_latch(bits: int, upper_is_old: bool) -> None:
    class TornLatch(Mutant):
        __doc__ = f"the latch is torn: its {'upper' if upper_is_old else 'lower'} part, from bit {bits}, is a tick old"

        def _see_edge(self, angle_rad: float) -> None:
            super()._see_edge(angle_rad)
            lower = (1 << bits) - 1
            old, new = self._loop.state.firmware.counts[-2], self._registers.latched_count
            torn = (old & ~lower) | (new & lower) if upper_is_old else (new & ~lower) | (old & lower)
            self._registers = self._registers._replace(latched_count=torn)

    caught_by("6.2/1:instant")(TornLatch)


for each in (8, 16, 24):
    torn_latch(each, upper_is_old=True)
    torn_latch(each, upper_is_old=False)
