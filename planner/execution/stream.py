"""From a planned motion to timed commands: one `A`, `S`, `P` for each step; no I/O.

The protocol transmits one decimal. If each value were rounded on its own, the errors would add up. Therefore each step
starts from the *predicted* position of the reference, exactly, after all earlier commands (`protocol.trapezoid`). It
uses the S, the A and the time that bring the reference nearest to the plan at the step's end (`closest_command`). So
the next step corrects the rounding error of the previous one. Steps that are too long for one command get several
(`pieces`).
"""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

from planner.defaults import RUN_ON_DEG
from planner.execution.closest_command import STANDING_DEG_S, Choice, Step, closest_command, going_on, with_target
from planner.execution.pieces import farthest_deg, pieces_of, spacing_s
from planner.execution.run_on import latest_s, next_command_within_s
from planner.execution.table_motion import Leg, MotionInTime, TableMotion
from planner.table.motion import Limits
from planner.table.wire import Grid, StreamError, Wire, exchanges_s
from protocol.trapezoid import MotionCommand, ReferenceState, advance

# Above this share of the maximum acceleration, a plan leaves no reserve to correct an error of the speed.
_AT_LIMIT = 0.97


class TimedCommand(NamedTuple):
    """A motion command and the time at which it takes effect: the arrival of the CR of its P.

    Attributes:
        time_s: in the time of the motion, 0 at the first scan location.
        leg: the leg that it belongs to.
        command: target, S and A, as transmitted.
        expected: the predicted reference at that time.
        chosen: the command before it got a target that serves until the next one; None where it is the same.
    """

    time_s: float
    leg: Leg
    command: MotionCommand
    expected: ReferenceState
    chosen: MotionCommand | None = None

    def reference_at(self, time_s: float) -> ReferenceState:
        """Return the position of the reference at a time from then on, until the next command."""
        return advance(self.expected, self.command, time_s - self.time_s)

    def going_on_at(self, time_s: float) -> ReferenceState:
        """Return the same without the braking for a target that the next command replaces before it brakes."""
        return advance(self.expected, self.chosen or self.command, time_s - self.time_s)


def stream(motion: TableMotion, limits: Limits, wire: Wire, run_on_deg: float = RUN_ON_DEG) -> tuple[TimedCommand, ...]:
    """Return the commands of a motion, in the order of their times.

    The table stands at the start of the motion, within the resolution of the protocol.

    Args:
        motion: the planned motion of the table.
        limits: maximum S and A.
        wire: resolution of the numbers.
        run_on_deg: maximum angle that the table may run on if the line fails. If this is not possible, the run-on is as
            short as the limits allow.

    Raises:
        StreamError: a limit is below the smallest number of the protocol.
    """
    return Streaming(motion, limits, wire, run_on_deg).commands()


class Encoder:
    """The command of each piece of a motion, starting from the reference after the commands before it."""

    def __init__(
        self,
        motion: MotionInTime,
        limits: Limits,
        wire: Wire,
        run_on_deg: float,
        spacing_s: float,
        enough_deg: float = 0.0,
    ) -> None:
        """Encode a motion.

        Args:
            motion: the planned motion of the table.
            limits: maximum S and A.
            wire: resolution of the numbers.
            run_on_deg: maximum angle that the table may run on if the line fails.
            spacing_s: minimum time from a command until the end of its piece.
            enough_deg: an error at which the search for a command ends; see `closest_command`.
        """
        self._motion, self._run_on_deg = motion, run_on_deg
        self._spacing_s, self._enough_deg = spacing_s, enough_deg
        self._grid = Grid(limits, wire)
        self._most_rate = _AT_LIMIT * limits.acceleration_deg_s2

    @property
    def start(self) -> ReferenceState:
        """Where the reference rests before the first command."""
        return ReferenceState(self._grid.nearest(self._motion.start_deg), 0.0)

    def choice(
        self,
        running: TimedCommand | None,
        before: Callable[[float], ReferenceState],
        piece: Leg,
        first_s: float | None = None,
    ) -> Choice:
        """Return the command of a piece: its given one, or the closest one.

        Args:
            running: the command before it, as it took effect; None at the start.
            before: the reference at a time without a new command, and without the braking before it; see
                `TimedCommand.going_on_at`.
            piece: the piece for the command.
            first_s: the time of the command, if it is given.
        """
        if piece.command is not None:
            return Choice(piece.start_s if first_s is None else first_s, self._grid.command(piece.command))
        begin_s = piece.start_s if running is None else max(piece.start_s, running.time_s)
        # A very late command has left little of the step; the rest of its error is corrected later.
        end_s = max(piece.end_s, begin_s + 0.5 * piece.duration_s)
        if first_s is None:
            # The command of the next piece may come at once, and needs its transmission time.
            latest_s = end_s - min(piece.duration_s, self._spacing_s)
            if running is not None:
                latest_s = min(latest_s, self.next_by_s(running))
            earliest_s, latest_s = begin_s, max(begin_s, latest_s)
        else:
            earliest_s = latest_s = first_s
        middle, end = (self._motion.state_at(time_s) for time_s in (0.5 * (begin_s + end_s), end_s))
        stands = max(abs(piece.start.speed_deg_s), abs(end.speed_deg_s)) <= STANDING_DEG_S
        planned = max(abs(leg.acceleration_deg_s2) for leg in (piece, self._motion.leg_at(end_s)))
        step = Step(begin_s, end_s, earliest_s, latest_s, middle, end, stands, planned > self._most_rate)
        return closest_command(before, step, self._grid, self._run_on_deg, self._enough_deg)

    def next_by_s(self, running: TimedCommand) -> float:
        """Return when the next command has to come at the latest, by plan: a step after this one it always may."""
        return running.time_s + max(self._within_s(running), running.leg.duration_s)

    def _within_s(self, running: TimedCommand) -> float:
        """Return the maximum time from a command to the next one that keeps the run-on of the first short."""
        _, speed, rate = running.command
        fastest = max(speed, abs(running.expected.speed_deg_s))
        return next_command_within_s(fastest, rate, running.leg.duration_s, self._run_on_deg)

    def aimed(self, timed: TimedCommand, next_s: float) -> TimedCommand:
        """Return a command with a target that is sufficient until the next command."""
        late_s = latest_s(timed.leg.duration_s)
        choice = Choice(timed.time_s, timed.command)
        command = with_target(choice, timed.expected, next_s, late_s, self._grid)
        return timed._replace(command=command, chosen=timed.command)


class Streaming:
    """The streaming of one motion, whole or from any of its commands on."""

    def __init__(self, motion: TableMotion, limits: Limits, wire: Wire, run_on_deg: float) -> None:
        """Divide the motion into the pieces with one command each; see `stream`."""
        self._encoder = Encoder(motion, limits, wire, run_on_deg, spacing_s(farthest_deg(motion), limits, wire))
        self._pieces = pieces_of(motion, limits, wire, run_on_deg)

    def commands(self) -> tuple[TimedCommand, ...]:
        """Return all commands."""
        return tuple(self._chain(None, self._encoder.start, self._pieces))

    def commands_after(self, running: TimedCommand, sent: int, next_s: float) -> Iterator[TimedCommand]:
        """Yield the commands after the first `sent` ones, from the reference that results from those.

        Args:
            running: the last command that was sent, as it took effect.
            sent: number of commands that were sent.
            next_s: time at which the next command takes effect; the target of the running one is valid until then.
        """
        return self._chain(running, running.expected, self._pieces[sent:], max(next_s, running.time_s))

    def _chain(
        self, running: TimedCommand | None, start: ReferenceState, pieces: Sequence[Leg], first_s: float | None = None
    ) -> Iterator[TimedCommand]:
        """Yield a command for each piece once the time of the next one is known, because its target depends on that."""
        pending: TimedCommand | None = None
        for piece in pieces:
            before = standing_at(start) if running is None else running.going_on_at
            choice = self._encoder.choice(running, before, piece, first_s)
            if pending is not None:
                yield self._encoder.aimed(pending, choice.time_s)
            running = pending = TimedCommand(choice.time_s, piece, choice.command, before(choice.time_s))
            first_s = None
        if pending is not None:
            yield pending


def standing_at(state: ReferenceState) -> Callable[[float], ReferenceState]:
    """Return the position of a resting reference, at any time."""
    return lambda _: state


def rounded_stream(motion: TableMotion, limits: Limits, wire: Wire) -> tuple[TimedCommand, ...]:
    """Return the commands with S and A of each step rounded independently: a baseline for `stream`."""
    grid = Grid(limits, wire)
    state = ReferenceState(grid.nearest(motion.start_deg), 0.0)
    commands = []
    for leg in motion.legs:
        if leg.command is not None:
            command = grid.command(leg.command)
        else:
            end_speed = leg.state_at(leg.end_s).speed_deg_s
            heading = end_speed if abs(end_speed) > STANDING_DEG_S else leg.acceleration_deg_s2
            speed = math.copysign(grid.speed(abs(end_speed)), heading)
            choice = Choice(leg.start_s, going_on(speed, grid.rate(abs(leg.acceleration_deg_s2))))
            command = with_target(choice, state, leg.end_s, latest_s(leg.duration_s), grid)
        commands.append(TimedCommand(leg.start_s, leg, command, state))
        state = advance(state, command, leg.duration_s)
    return tuple(commands)


def check_it_fits(commands: Sequence[TimedCommand], wire: Wire) -> None:
    """Refuse commands that the serial line cannot transmit in time.

    Raises:
        StreamError: the message states a sufficient step.
    """
    for before, following in pairwise(commands):
        needed_s = exchanges_s(wire, following.command, before.command)
        step_s = following.time_s - before.time_s
        if needed_s > step_s:
            most_s = max(exchanges_s(wire, two.command, one.command) for one, two in pairwise(commands))
            raise StreamError(
                f"the commands of location {following.leg.column} take {1000 * needed_s:.0f} ms at {wire.baud} baud,"
                f" but the previous step takes {1000 * step_s:.0f} ms; "
                f"use a time step of at least {math.ceil(100 * most_s) / 100:g} s"
            )


def reference_states(commands: Iterable[TimedCommand], times_s: Iterable[float]) -> Iterator[ReferenceState]:
    """Yield the position of the reference at ascending times, by the controller's rules."""
    following = iter(commands)
    current, after = next(following), next(following, None)
    for time_s in times_s:
        while after is not None and after.time_s <= time_s:
            current, after = after, next(following, None)
        yield current.reference_at(max(time_s, current.time_s))
