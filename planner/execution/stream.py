"""From a planned motion to timed commands: one `A`, `S`, `P` for each step, no I/O.

The wire carries one decimal. Rounding each value on its own would let the errors add up, so each step starts from where
the reference is *predicted* to be, exactly, after all commands before it (`velocity_profile`), and takes the S and A
that bring it nearest to the plan at the step's end (`closest_command`): what one step could not say, the next one takes
out.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

from planner.execution.closest_command import STANDING_DEG_S, closest_command, command_towards
from planner.execution.table_motion import Leg, TableMotion
from planner.table.motion import Limits
from planner.table.velocity_profile import MotionCommand, ReferenceState, advance
from planner.table.wire import Grid, StreamError, Wire, exchanges_s


class TimedCommand(NamedTuple):
    """A motion command and the moment at which it takes effect: when the CR of its P has arrived.

    Attributes:
        time_s: in the time of the motion, 0 at the first scan location.
        leg: what it is for.
        command: target, S and A, as the wire carries them.
        expected: where the reference is at that moment.
    """

    time_s: float
    leg: Leg
    command: MotionCommand
    expected: ReferenceState


def stream(
    motion: TableMotion, limits: Limits, wire: Wire, first: int = 0, start: ReferenceState | None = None
) -> tuple[TimedCommand, ...]:
    """Return the commands of a motion, in the order of their times.

    Args:
        motion: what the table should do.
        limits: greatest S and A.
        wire: how fine the numbers are.
        first: the first leg to command; those before are done.
        start: where the reference is at its beginning; None: at rest at the motion's start, as far as the wire can say
            that.

    Raises:
        StreamError: a limit is below the smallest number that the wire can say.
    """
    grid = Grid(limits, wire)
    state = start or ReferenceState(grid.nearest(motion.start_deg), 0.0)
    commands = []
    for leg in motion.legs[first:]:
        command = grid.command(leg.command) if leg.command else closest_command(state, leg, grid)
        commands.append(TimedCommand(leg.start_s, leg, command, state))
        state = advance(state, command, leg.duration_s)
    return tuple(commands)


def rounded_stream(motion: TableMotion, limits: Limits, wire: Wire) -> tuple[TimedCommand, ...]:
    """Return the commands with S and A of each step rounded on its own: what `stream` is to be compared with."""
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
            command = command_towards(state, speed, grid.rate(abs(leg.acceleration_deg_s2)), leg.duration_s, grid)
        commands.append(TimedCommand(leg.start_s, leg, command, state))
        state = advance(state, command, leg.duration_s)
    return tuple(commands)


def check_it_fits(commands: Sequence[TimedCommand], wire: Wire) -> None:
    """Refuse commands that follow one another faster than the wire carries them.

    Raises:
        StreamError: with the step that would fit.
    """
    for before, following in pairwise(commands):
        needed_s = exchanges_s(wire, following.command, before.command)
        step_s = following.time_s - before.time_s
        if needed_s > step_s:
            most_s = max(exchanges_s(wire, two.command, one.command) for one, two in pairwise(commands))
            raise StreamError(
                f"the commands of location {following.leg.column} take {1000 * needed_s:.0f} ms at {wire.baud} baud,"
                f" and the step before lasts {1000 * step_s:.0f} ms; a time step of {math.ceil(100 * most_s) / 100:g} s"
                " would fit"
            )


def reference_states(commands: Iterable[TimedCommand], times_s: Iterable[float]) -> Iterator[ReferenceState]:
    """Yield where the reference is at ascending times, by the controller's own rules."""
    following = iter(commands)
    current, after = next(following), next(following, None)
    for time_s in times_s:
        while after is not None and after.time_s <= time_s:
            current, after = after, next(following, None)
        yield advance(current.expected, current.command, max(0.0, time_s - current.time_s))
