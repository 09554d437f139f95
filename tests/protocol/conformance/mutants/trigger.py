"""Wrong tables: the trigger, and the way back from a half line."""

from tests.protocol.conformance.mutants.mutant import Mutant, caught_by


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


@caught_by("8.3/1")
class CancelIsIgnored(Mutant):
    """CAN is passed over, and the half line carried out"""

    def receive(self, data: bytes) -> None:
        super().receive(data.replace(b"\x18", b""))
