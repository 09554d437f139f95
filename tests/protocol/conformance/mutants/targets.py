"""Wrong tables: the target of a motion."""

from decimal import Decimal

from protocol.messages import Command, Verb
from tests.protocol.conformance.mutants.mutant import Line, Mutant, Rereads, caught_by, value_of, verb_of


@caught_by("4.4/1")
class ShortWayRound(Rereads):
    """P takes the shorter direction"""

    def instead(self, command: Command) -> Command:
        if command.verb is Verb.MOVE_BY:
            return command
        turns = round((value_of(command) - self.position()) / 360)
        return Command(Verb.MOVE_TO, value_of(command) - 360 * turns)


@caught_by("6.1/4")
class SparesItsCable(Rereads):
    """in the backward direction it turns by half a turn at most"""

    def instead(self, command: Command) -> Command:
        if command.verb is Verb.MOVE_BY:
            return command
        return Command(Verb.MOVE_TO, max(value_of(command), self.target() - 180))


@caught_by("4.4/4")
class OkIsArrival(Mutant):
    """P is answered when the table has arrived"""

    says = "had arrived when it sent OK"
    held = b""

    def _reply(self, command: Line) -> bytes:
        reply = super()._reply(command)
        if verb_of(command) is Verb.MOVE_TO:
            reply, self.held = b"", reply
        return reply

    def ticks_until_sent(self, wanted: int) -> int | None:
        return 1 if self.held else super().ticks_until_sent(wanted)

    def advance(self, ticks: int) -> None:
        super().advance(ticks)
        if self.held and not self.moving:
            self._serial.write(self.held, self.tick)
            self.held = b""


@caught_by("4.5/1")
class IncrementFromTheOldTarget(Rereads):
    """R counts from the old target"""

    def instead(self, command: Command) -> Command:
        return Command(Verb.MOVE_TO, self.target() + value_of(command)) if command.verb is Verb.MOVE_BY else command


@caught_by("4.5/2")
class IncrementFromTheDisplay(Rereads):
    """R counts from the reported position"""

    def instead(self, command: Command) -> Command:
        if command.verb is Verb.MOVE_TO:
            return command
        return Command(Verb.MOVE_TO, round(self.position(), 1) + value_of(command))


@caught_by("4.5/3")
class IgnoresNothing(Rereads):
    """R 0 is ignored because there is nothing to do"""

    def instead(self, command: Command) -> Command | None:
        return None if command.verb is Verb.MOVE_BY and value_of(command) == 0 else command


@caught_by("4.5/4")
class TakesNothingForALittle(Rereads):
    """R 0 turns it by a fifth of a degree"""

    def instead(self, command: Command) -> Command:
        nothing = command.verb is Verb.MOVE_BY and value_of(command) == 0
        return Command(Verb.MOVE_BY, Decimal("0.2")) if nothing else command


class PassesOverFarOnes(Rereads):
    """Sends `OK` to a target beyond the counter, and does nothing."""

    verb = Verb.MOVE_TO

    def instead(self, command: Command) -> Command | None:
        return None if command.verb is self.verb and abs(value_of(command)) >= 2**22 else command


@caught_by("4.4/2")
class PassesOverFarTargets(PassesOverFarOnes):
    """a position beyond the counter is ignored, not refused"""


@caught_by("4.5/5")
class PassesOverFarIncrements(PassesOverFarOnes):
    """an increment beyond the counter is ignored, not refused"""

    verb = Verb.MOVE_BY


@caught_by("4.4/3")
class GoesAcrossTheEnd(Rereads):
    """to a position too far away it goes the other way, across the end of the counter"""

    def instead(self, command: Command) -> Command:
        way = value_of(command) - self.target()
        too_far = command.verb is Verb.MOVE_TO and abs(way) >= 2**22 and abs(value_of(command)) < 2**22
        return Command(Verb.MOVE_BY, way - Decimal(2**23).copy_sign(way)) if too_far else command


@caught_by("6.1/2")
class ThreeBytes(Rereads):
    """a position that does not fit three bytes is out of its range"""

    def instead(self, command: Command) -> Command:
        return Command(command.verb, Decimal(2**32)) if abs(value_of(command)) * 512 >= 2**23 else command


@caught_by("6.1/3")
class StopsAtTheEndOfTheCounter(Rereads):
    """at the end of the counter it stops"""

    def instead(self, command: Command) -> Command | None:
        beyond = abs(self._loop.state.firmware.counts[-1] + int(value_of(command) * 512)) >= 2**31
        return None if command.verb is Verb.MOVE_BY and beyond else command


@caught_by("6.1/3")
class StumblesOverTheEnd(Mutant):
    """at the end of the counter the reference's speed steps to 0"""

    says = "past the limit and back"

    def advance(self, ticks: int) -> None:
        before = self._loop.state.firmware.reference.position_count
        super().advance(ticks)
        if abs(self._loop.state.firmware.reference.position_count - before) > 2**31:
            self.step_to(0)


def refuses_half(verb: Verb, way: str, case: str) -> None:
    class RefusesHalf(Rereads):
        __doc__ = f"{verb} {way} is refused, though it is half the counter's range"

        def instead(self, command: Command) -> Command:
            far = command.verb is verb and value_of(command) == Decimal(way)
            return Command(verb, Decimal(2**40)) if far else command

    caught_by(case)(RefusesHalf)


refuses_half(Verb.MOVE_TO, "-4194304", "4.4/3:half")
refuses_half(Verb.MOVE_BY, "-4194304", "4.5/5:half")
refuses_half(Verb.MOVE_BY, "4194304", "4.5/5:half")


@caught_by("4.4/3:half")
class TakesMoreThanHalf(Rereads):
    """a motion a little longer than half the counter's range is accepted, and begun"""

    def instead(self, command: Command) -> Command:
        too_far = command.verb is Verb.MOVE_TO and value_of(command) == -(2**22) and self.target() > 0
        return Command(Verb.MOVE_BY, Decimal(-(2**22))) if too_far else command


@caught_by("4.5/5:half")
class HalfIsBackwards(Rereads):
    """an increment of half the counter's range turns the other way"""

    def instead(self, command: Command) -> Command:
        half = command.verb is Verb.MOVE_BY and value_of(command) == 2**22
        return Command(Verb.MOVE_BY, Decimal(-(2**22))) if half else command
