"""Wrong tables: a motion that replaces another."""

from protocol.messages import Command, Verb
from tests.protocol.conformance.mutants.mutant import MOTIONS, Line, Mutant, Rereads, caught_by, value_of, verb_of


@caught_by("7.3/1")
class FinishesFirst(Rereads):
    """a target during a motion is ignored"""

    def instead(self, command: Command) -> Command | None:
        return None if self.moving and command.verb is Verb.MOVE_TO else command


@caught_by("4.1/11:random")
class Debounces(Rereads):
    """a P soon after another is taken for its echo"""

    last_tick = -1000

    def instead(self, command: Command) -> Command | None:
        if command.verb is Verb.MOVE_BY:
            return command
        since, self.last_tick = self.tick - self.last_tick, self.tick
        return None if since < 300 else command


@caught_by("7.3/7")
class QueuesMotions(Rereads):
    """motions are executed one after the other"""

    queue: tuple[Command, ...] = ()

    def waits(self, command: Command) -> bool:  # noqa: ARG002 - others look at it
        return True

    def instead(self, command: Command) -> Command | None:
        if self.moving and self.waits(command):
            self.queue += (command,)
            return None
        return command

    def advance(self, ticks: int) -> None:
        super().advance(ticks)
        if self.queue and not self.moving:
            first, *rest = self.queue
            self.queue = tuple(rest)
            self._reply(first)


@caught_by("7.3/3:behind")
class QueuesWhatLiesBehind(QueuesMotions):
    """a target behind waits for the end of the motion"""

    def waits(self, command: Command) -> bool:
        way = value_of(command) - (self.position() if command.verb is Verb.MOVE_TO else 0)
        return way * self._loop.state.firmware.reference.speed < 0


class StepsToStandstill(Rereads):
    """Starts a new motion from speed 0, at once, under a condition."""

    def steps(self, command: Command) -> bool:
        raise NotImplementedError

    def instead(self, command: Command) -> Command:
        if self.moving and self.steps(command):
            self.step_to(0)
        return command


@caught_by("7.3/2")
class StepsAtPreemption(StepsToStandstill):
    """at a new target the speed of the reference steps to 0"""

    def steps(self, command: Command) -> bool:  # noqa: ARG002 - at each
        return True


@caught_by("7.3/6")
class BeginsAgain(StepsToStandstill):
    """the same target again makes it begin from speed 0"""

    def steps(self, command: Command) -> bool:
        return command.verb is Verb.MOVE_TO and value_of(command) == self.target()


@caught_by("7.3/3:reversal")
class TurnsOnTheSpot(StepsToStandstill):
    """in the backward direction it does not brake for a target behind"""

    def steps(self, command: Command) -> bool:
        return self._loop.state.firmware.reference.speed < 0 and value_of(command) > self.position()


@caught_by("7.3/3:near")
class BrakesTooHard(Rereads):
    """it brakes harder than A if it would pass its target"""

    def instead(self, command: Command) -> Command:
        way, braking_way = value_of(command) - self.position(), self.braking_way()
        if command.verb is Verb.MOVE_TO and 0 < way < braking_way:
            harder = int(self._registers.acceleration * braking_way / way)
            self._registers = self._registers._replace(acceleration=harder)
        return command


@caught_by("7.3/3:stop")
class DoesNotReturn(Rereads):
    """R 0 stops it permanently where it comes to rest"""

    def instead(self, command: Command) -> Command:
        stop = command.verb is Verb.MOVE_BY and value_of(command) == 0
        return Command(Verb.MOVE_BY, self.braking_way()) if stop else command


@caught_by("7.3/4")
class StepsToALowerSpeed(Mutant):
    """a lower S is taken in one step"""

    def _reply(self, command: Line) -> bytes:
        reply = super()._reply(command)
        if verb_of(command) is Verb.MOVE_TO:
            top, speed = self._registers.speed, self._loop.state.firmware.reference.speed
            self.step_to(max(-top, min(top, speed)))
        return reply


class KeepsTheOld(Mutant):
    """Keeps an old setting when a motion replaces another."""

    def kept(self, speed: int, acceleration: int) -> tuple[int, int]:
        """Return the settings of the new motion, from those of the old one."""
        raise NotImplementedError

    def _reply(self, command: Line) -> bytes:
        before, was_moving = self._loop.state.firmware.profile, self.moving
        reply = super()._reply(command)
        if was_moving and verb_of(command) in MOTIONS:
            self.rerun(*self.kept(before.speed, before.acceleration))
        return reply


@caught_by("7.3/4:higher")
class KeepsTheOldSpeed(KeepsTheOld):
    """a new S waits until the table rests"""

    def kept(self, speed: int, acceleration: int) -> tuple[int, int]:  # noqa: ARG002 - that is new
        return speed, self._registers.acceleration


@caught_by("7.3/5")
class KeepsTheOldAcceleration(KeepsTheOld):
    """a new A waits until the table rests"""

    def kept(self, speed: int, acceleration: int) -> tuple[int, int]:  # noqa: ARG002 - that is new
        return self._registers.speed, acceleration


@caught_by("7.3/5:lower")
class KeepsAHigherAcceleration(KeepsTheOld):
    """a lower A waits until the table rests"""

    def kept(self, speed: int, acceleration: int) -> tuple[int, int]:  # noqa: ARG002 - that is new
        return self._registers.speed, max(acceleration, self._registers.acceleration)


class StartsFromTheMotor(Rereads):
    """Starts a motion that replaces another from the measured state of the motor."""

    def start_from(self, speed: int) -> None:
        self.step_to(speed)

    def instead(self, command: Command) -> Command:
        if self.moving:
            controller = self._loop.state.firmware
            window_ticks = self.config.control.speed_window_ticks
            self.start_from((controller.pid.measured << self.bits) // window_ticks)
        return command


@caught_by("7.3/2:accelerating")
class StartsFromTheMeasuredSpeed(StartsFromTheMotor):
    """a motion that replaces another starts from the measured speed"""
