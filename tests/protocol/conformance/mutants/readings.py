"""Wrong tables: the replies to `H` and `L`, and their form."""

from decimal import ROUND_DOWN, ROUND_HALF_UP, Decimal

from protocol.messages import Command, Verb
from tests.protocol.conformance.mutants.mutant import Line, Mutant, caught_by, verb_of


@caught_by("4.2/1")
class TellsTheTarget(Mutant):
    """H returns the target of the motion"""

    def _reply(self, command: Line) -> bytes:
        if verb_of(command) is Verb.READ_POSITION:
            return b"H %.1f\r" % (round(self.target(), 1) + 0)
        return super()._reply(command)


@caught_by("4.2/2")
class StalePosition(Mutant):
    """the position is updated ten times a second"""

    last = (-100, b"")

    def _reply(self, command: Line) -> bytes:
        if verb_of(command) is Verb.READ_POSITION:
            if self.tick - self.last[0] >= 100:
                self.last = self.tick, super()._reply(command)
            return self.last[1]
        return super()._reply(command)


@caught_by("4.2/3")
class Modulo360(Mutant):
    """the position is returned modulo 360"""

    def _reply(self, command: Line) -> bytes:
        if verb_of(command) is Verb.READ_POSITION:
            return b"H %.1f\r" % (float(self.position()) % 360)
        return super()._reply(command)


@caught_by("4.2/4")
class ReadingLatches(Mutant):
    """reading the position overwrites the latch"""

    def _reply(self, command: Line) -> bytes:
        if verb_of(command) is Verb.READ_POSITION:
            self.trigger()
        return super()._reply(command)


@caught_by("4.3/1")
class AnswersLWithH(Mutant):
    """L is answered with an H"""

    def _reply(self, command: Line) -> bytes:
        return super()._reply(command).replace(b"L", b"H")


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


@caught_by("5.2/1")
class LatchInCounts(Mutant):
    """L returns the latch in counts"""

    def _reply(self, command: Line) -> bytes:
        if verb_of(command) is Verb.READ_LATCH:
            return b"L %d\r" % self._registers.latched_count
        return super()._reply(command)


class Renders(Mutant):
    """Returns angles in another form."""

    def form(self, angle: Decimal) -> str:
        raise NotImplementedError

    reads_latch = False

    def _reply(self, command: Line) -> bytes:
        reply = super()._reply(command)
        if reply[:2] not in {b"H ", b"L "}:
            return reply
        self.reads_latch = reply[:1] == b"L"
        count = self._registers.latched_count if self.reads_latch else self._loop.state.firmware.counts[-1]
        return reply[:2] + self.form(Decimal(count) / 512).encode() + b"\r"


@caught_by("5.2/5")
class MinusZero(Renders):
    """-0.0"""

    def form(self, angle: Decimal) -> str:
        return f"{float(angle):.1f}"


@caught_by("5.2/5:motion")
class MinusZeroOnTheWay(MinusZero):
    """-0.0 while it moves"""

    def form(self, angle: Decimal) -> str:
        return super().form(angle if self.moving else round(angle, 1) + 0)


@caught_by("5.2/1:negative")
class LosesTheSign(Renders):
    """the sign goes with the whole degrees: -0.5 is 0.5"""

    def form(self, angle: Decimal) -> str:
        tenths = int(round(angle, 1) * 10)
        return f"{int(tenths / 10)}.{abs(tenths) % 10}"


@caught_by("5.2/3")
class Truncates(Renders):
    """angles are cut, not rounded"""

    def form(self, angle: Decimal) -> str:
        return str(angle.quantize(Decimal("0.1"), ROUND_DOWN) + 0)


@caught_by("5.2/3")
class TruncatesTheLatch(Truncates):
    """the latch is cut, not rounded"""

    def form(self, angle: Decimal) -> str:
        return super().form(angle if self.reads_latch else round(angle, 1))


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
