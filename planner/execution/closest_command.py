"""The command, and its moment, that bring the reference nearest to the plan in one step, of what the wire can say.

From the command's moment on the reference goes from its present speed v to S at the rate A, and then holds S. Before
it, it holds v. So in a step it gets farther by (S - v) r than without the command, where r is the time that is left in
the middle of the ramp: the moment decides where the step ends, as finely as clocks go, though S and A are coarse. A
ramp in the middle of a step ends like the plan's acceleration all through it, at the same angle and the same speed. So
A may be greater than the plan's, which keeps the table's run-on short (`run_on`).

P only gives the direction, but the controller brakes for it: `with_target` sets it beyond the way to stop, once the
moment of the next command is known.
"""

import math
from collections.abc import Callable, Iterator
from functools import cache
from itertools import chain
from typing import NamedTuple

from planner.execution.run_on import least_rate
from planner.table.wire import Grid
from protocol.trapezoid import MotionCommand, ReferenceState, advance

# A speed below this counts as standing: it is what additions leave of zero.
STANDING_DEG_S = 1e-6
# What a deg of error at the end of a step is weighed against: half as much in its middle; and the way that an error of
# the end's speed makes in a third of a step, or in a whole one where the plan leaves no acceleration to make up for it.
_MIDDLE_WEIGHT = 0.5
_SPEED_WEIGHT, _SPEED_WEIGHT_AT_LIMIT = 0.3, 1.0
# In the smallest share, the way to brake counts, so that of equals the one is taken which stops soonest; and an A is
# tried for which that way is short.
_BRAKING_WEIGHT = 3e-5
_SHORT_BRAKING_DEG = 3.0
# And how much of the speed counts that a ramp is to gain after the step, because the next command breaks it off.
_UNFINISHED_SHARE = 0.1
_SPEEDS = 4

Before = Callable[[float], ReferenceState]
"""Where the reference is at a time, without a new command."""


class Step(NamedTuple):
    """What a command is chosen for.

    Attributes:
        begin_s: when the step begins.
        end_s: when it ends.
        earliest_s: the first moment at which the command may take effect.
        latest_s: the last one.
        middle: the planned state in the step's middle.
        end: the planned state at its end.
        stands: whether the plan stands all through it.
        is_at_limit: whether the plan needs all acceleration that there is, in this step or in the next.
    """

    begin_s: float
    end_s: float
    earliest_s: float
    latest_s: float
    middle: ReferenceState
    end: ReferenceState
    stands: bool
    is_at_limit: bool

    @property
    def duration_s(self) -> float:
        """How long it lasts."""
        return self.end_s - self.begin_s

    def error_of_end(self, end: ReferenceState, ahead_deg_s: float) -> float:
        """Return the squared error, in deg^2, of a reference at the end whose ramp is not over by so much."""
        speed_weight = _SPEED_WEIGHT_AT_LIMIT if self.is_at_limit else _SPEED_WEIGHT
        off_deg_s = abs(end.speed_deg_s - self.end.speed_deg_s) + _UNFINISHED_SHARE * ahead_deg_s
        return (end.angle_deg - self.end.angle_deg) ** 2 + (speed_weight * self.duration_s * off_deg_s) ** 2

    def error_of_middle(self, middle: ReferenceState) -> float:
        """Return the squared error, in deg^2, of a reference in the middle."""
        return (_MIDDLE_WEIGHT * (middle.angle_deg - self.middle.angle_deg)) ** 2


class Choice(NamedTuple):
    """A command and its moment; the target of one that goes on after the step is infinitely far."""

    time_s: float
    command: MotionCommand


def closest_command(before: Before, step: Step, grid: Grid, run_on_deg: float) -> Choice:
    """Return the command that brings the reference nearest to the plan by the end of a step.

    Args:
        before: where the reference is at a time without the command.
        step: what is wanted.
        grid: the numbers that the wire can say.
        run_on_deg: how far the table may run on when the line dies.
    """
    best, least = None, math.inf
    before = cache(before)  # most candidates share their moments
    candidates = [] if step.stands else [_ramps(before, step, grid, run_on_deg)]
    if abs(step.end.speed_deg_s) <= STANDING_DEG_S:
        candidates.append(_stops(before(step.earliest_s), step, grid))
    for choice in chain.from_iterable(candidates):
        error = _error_of(choice, before, step, least)
        if error < least:
            best, least = choice, error
    assert best is not None
    return best


def with_target(choice: Choice, begin: ReferenceState, next_s: float, late_s: float, grid: Grid) -> MotionCommand:
    """Return a command with the nearest target for which the table does not brake before the next command.

    Args:
        choice: the command.
        begin: where the reference is at its moment.
        next_s: when the next command is due.
        late_s: how late it may come.
        grid: the numbers that the wire can say.
    """
    target_deg, speed, rate = choice.command
    if math.isfinite(target_deg):
        return choice.command
    forward = math.copysign(1.0, target_deg)
    late = advance(begin, choice.command, next_s + late_s - choice.time_s)
    farthest_deg = forward * begin.angle_deg
    if forward * late.speed_deg_s > 0.0:
        farthest_deg = max(farthest_deg, forward * late.angle_deg + 0.5 * late.speed_deg_s**2 / rate)
    return MotionCommand(grid.beyond(forward * farthest_deg, forward), speed, rate)


def going_on(speed_deg_s: float, rate_deg_s2: float) -> MotionCommand:
    """Return the command of a signed speed, without end."""
    return MotionCommand(math.copysign(math.inf, speed_deg_s), abs(speed_deg_s), rate_deg_s2)


def _error_of(choice: Choice, before: Before, step: Step, least: float) -> float:
    """Return the error of a choice, or a part of it that is not below `least` already."""
    turning = before(choice.time_s)

    def state_at(time_s: float) -> ReferenceState:
        if time_s <= choice.time_s:
            return before(time_s)
        return advance(turning, choice.command, time_s - choice.time_s)

    target_deg, speed, rate = choice.command
    end = state_at(step.end_s)
    ahead_deg_s = abs(math.copysign(speed, target_deg) - end.speed_deg_s) if math.isinf(target_deg) else 0.0
    error = step.error_of_end(end, ahead_deg_s) + (_BRAKING_WEIGHT * 0.5 * speed**2 / rate) ** 2
    return error if error >= least else error + step.error_of_middle(state_at(0.5 * (step.begin_s + step.end_s)))


def _ramps(before: Before, step: Step, grid: Grid, run_on_deg: float) -> Iterator[Choice]:
    """Yield commands around those that would meet the end of a step if any number could be said.

    For each S the middle of the ramp follows from the way. Its moment then follows from A: the ramp may last as long as
    the step, or be so short that the run-on is.
    """
    begin, unchanged = before(step.begin_s), before(step.end_s)
    missing_deg = step.end.angle_deg - unchanged.angle_deg
    unfinished = 2.0 * abs(missing_deg) / step.duration_s**2
    for top in _speeds(unchanged.speed_deg_s, missing_deg, step, grid):
        change = top - unchanged.speed_deg_s
        middle_s = step.end_s - (missing_deg / change if change else 0.5 * step.duration_s)
        fastest = max(abs(top), abs(begin.speed_deg_s), abs(unchanged.speed_deg_s))
        floor = grid.rate_at_least(least_rate(fastest, step.duration_s, run_on_deg))
        rates = {floor}
        for rate in (unfinished, 0.5 * top**2 / _SHORT_BRAKING_DEG, *_rates(abs(change), middle_s, step)):
            rates.update(max(number, floor) for number in grid.rates_around(rate))
        for rate in rates:
            ramp_s = abs(change) / rate
            last_s = min(step.latest_s, step.end_s - ramp_s)
            for time_s in {step.earliest_s, max(step.earliest_s, min(middle_s - 0.5 * ramp_s, last_s))}:
                yield Choice(time_s, going_on(top, rate))


def _speeds(unchanged_deg_s: float, missing_deg: float, step: Step, grid: Grid) -> set[float]:
    """Return the signed S to try: around the plan's, and those that make up for a way that is missing.

    With the ramp at once, as late as it may come, or in the middle of the step.
    """
    speeds = {*grid.speeds_around(step.end.speed_deg_s, _SPEEDS)}
    for left_s in (step.end_s - step.earliest_s, step.end_s - step.latest_s, 0.5 * step.duration_s):
        if left_s > 0.0:
            speeds.update(grid.speeds_around(unchanged_deg_s + missing_deg / left_s, 1))
    return speeds


def _rates(change_deg_s: float, middle_s: float, step: Step) -> Iterator[float]:
    """Yield the A of ramps with a given middle that begin or end with the step, or at the first or the last moment."""
    for half_s in (
        0.5 * step.duration_s,
        middle_s - step.earliest_s,
        middle_s - step.latest_s,
        step.end_s - middle_s,
    ):
        if half_s > 0.0:
            yield 0.5 * change_deg_s / half_s


def _stops(start: ReferenceState, step: Step, grid: Grid) -> Iterator[Choice]:
    """Yield commands that bring the reference to rest, near the end of a step that ends at rest.

    Where the plan stands the table does, on the nearest number: it does not swing between two that lie around the plan.
    """
    shifts = (0,) if step.stands else (-1, 0, 1)
    left_s = step.end_s - step.earliest_s
    way = abs(step.end.angle_deg - start.angle_deg)
    braking = 0.5 * start.speed_deg_s**2 / way if way > 0.0 else abs(start.speed_deg_s) / left_s
    for target in (grid.nearest(step.end.angle_deg + shift * grid.quantum) for shift in shifts):
        for speed in (grid.speed(abs(start.speed_deg_s)), grid.speed(abs(start.speed_deg_s) + grid.quantum)):
            for rate in (*grid.rates_around(braking), *grid.rates_around(1.2 * braking), grid.rate(10.0 * braking)):
                yield Choice(step.earliest_s, MotionCommand(target, speed, rate))
