"""Wrong tables: the target of a motion, its profile, and what replaces it."""

from decimal import Decimal

from protocol.messages import Command, Verb
from tests.protocol.conformance.mutants.mutant import Line, Mutant, caught_by, verb_of
from tests.protocol.conformance.mutants.settings import Resettles


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


class PassesOverFarOnes(Rereads):
    """Says `OK` to what leads out of the counter, and does nothing."""

    verb = Verb.MOVE_TO

    def instead(self, command: Command) -> Command | None:
        return None if command.verb is self.verb and abs(value_of(command)) >= 2**22 else command


@caught_by("4.4/2")
class PassesOverFarTargets(PassesOverFarOnes):
    """a position beyond the counter is passed over, not refused"""


@caught_by("4.5/5")
class PassesOverFarIncrements(PassesOverFarOnes):
    """an increment beyond the counter is passed over, not refused"""

    verb = Verb.MOVE_BY


@caught_by("4.5/4")
class TakesNothingForALittle(Rereads):
    """R 0 turns it by a fifth of a degree"""

    def instead(self, command: Command) -> Command:
        nothing = command.verb is Verb.MOVE_BY and value_of(command) == 0
        return Command(Verb.MOVE_BY, Decimal("0.2")) if nothing else command


@caught_by("7.2/4")
class Drifts(Rereads):
    """each motion ends a fiftieth of a degree farther on"""

    motions = 0

    def instead(self, command: Command) -> Command:
        self.motions += 1
        if command.verb is Verb.MOVE_BY:
            return command
        return Command(Verb.MOVE_TO, value_of(command) + self.motions * Decimal("0.02"))


@caught_by("7.3/6")
class BeginsAgain(Rereads):
    """the same target again makes it begin from speed 0"""

    def instead(self, command: Command) -> Command:
        controller = self._state.firmware
        if self.moving and command.verb is Verb.MOVE_TO and value_of(command) == self.target():
            standing = controller._replace(reference=controller.reference._replace(speed=0))
            self._state = self._state._replace(firmware=standing)
        return command
