"""Find the command, and its time, that bring the reference nearest to the plan within one step.

The protocol limits the resolution of the command. From the time of the command on, the reference changes its present
speed v to S at the rate A, and then keeps S. Before that time, it keeps v.

So in a step it travels farther by (S - v) r than without the command. Here r is the time from the middle of the ramp to
the end of the step. Therefore the time of the command determines the position at the end of the step. Its resolution is
that of the clock, although S and A are coarse.

A ramp in the middle of a step ends at the same angle and the same speed as the plan's acceleration over the whole step.
So A may be larger than the plan's, which keeps the table's run-on short (`run_on`).

P only gives the direction, but the controller brakes for it. `with_target` sets P beyond the braking distance, once the
time of the next command is known.
"""

import math
from collections.abc import Callable, Iterator
from functools import cache
from itertools import chain
from typing import NamedTuple

from planner.execution.run_on import least_rate
from planner.table.wire import Grid
from protocol.trapezoid import MotionCommand, ReferenceState, advance

# A lower speed counts as standstill: it is a rounding error of sums.
STANDING_DEG_S = 1e-6
# Weights relative to an error in deg at the end of a step: half for its middle. An error of the final speed counts as
# its travel within a third of a step. If the plan leaves no acceleration for a correction, it counts as its travel
# within a whole step.
_MIDDLE_WEIGHT = 0.5
_SPEED_WEIGHT, _SPEED_WEIGHT_AT_LIMIT = 0.3, 1.0
# Small weight for the braking distance, so that among equal commands the one that stops first is chosen; and an A is
# tried for which this distance is short.
_BRAKING_WEIGHT = 3e-5
_SHORT_BRAKING_DEG = 3.0
# Weight of the speed that a ramp would gain after the step: the next command interrupts it.
_UNFINISHED_SHARE = 0.1
_SPEEDS = 4

Before = Callable[[float], ReferenceState]
"""Position and speed of the reference at a time, without a new command."""


class Step(NamedTuple):
    """The goal for the choice of a command.

    Attributes:
        begin_s: start of the step.
        end_s: end of the step.
        earliest_s: first time at which the command may take effect.
        latest_s: last time at which it may take effect.
        middle: the planned state in the middle of the step.
        end: the planned state at its end.
        stands: whether the plan stands during the whole step.
        is_at_limit: whether the plan needs the maximum acceleration in this step or in the next one.
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
        """The duration of the step."""
        return self.end_s - self.begin_s

    def error_of_end(self, end: ReferenceState, ahead_deg_s: float) -> float:
        """Return the squared error, in deg^2, of a reference at the end whose ramp lacks the given speed."""
        speed_weight = _SPEED_WEIGHT_AT_LIMIT if self.is_at_limit else _SPEED_WEIGHT
        off_deg_s = abs(end.speed_deg_s - self.end.speed_deg_s) + _UNFINISHED_SHARE * ahead_deg_s
        return (end.angle_deg - self.end.angle_deg) ** 2 + (speed_weight * self.duration_s * off_deg_s) ** 2

    def error_of_middle(self, middle: ReferenceState) -> float:
        """Return the squared error, in deg^2, of a reference in the middle."""
        return (_MIDDLE_WEIGHT * (middle.angle_deg - self.middle.angle_deg)) ** 2


class Choice(NamedTuple):
    """A command and its time. The target of a command that continues after the step is infinitely far."""

    time_s: float
    command: MotionCommand


def closest_command(before: Before, step: Step, grid: Grid, run_on_deg: float, enough_deg: float = 0.0) -> Choice:
    """Return the command that brings the reference nearest to the plan at the end of a step.

    Args:
        before: the reference at a time, without the command.
        step: the goal.
        grid: the resolution of the numbers in the protocol.
        run_on_deg: maximum angle that the table may run on if the line fails.
        enough_deg: the search ends at a command with at most this error; 0 searches all.
    """
    best, least = None, math.inf
    before = cache(before)  # most candidates have the same times
    candidates = [] if step.stands else [_ramps(before, step, grid, run_on_deg)]
    if abs(step.end.speed_deg_s) <= STANDING_DEG_S:
        candidates.append(_stops(before(step.earliest_s), step, grid))
    for choice in chain.from_iterable(candidates):
        error = _error_of(choice, before, step, least)
        if error < least:
            best, least = choice, error
            if least <= enough_deg**2:
                break
    assert best is not None
    return best


def with_target(choice: Choice, begin: ReferenceState, next_s: float, late_s: float, grid: Grid) -> MotionCommand:
    """Return a command with the nearest target for which the table does not brake before the next command.

    Args:
        choice: the command.
        begin: the reference at the time of the command.
        next_s: due time of the next command.
        late_s: maximum delay of the next command.
        grid: the resolution of the numbers in the protocol.
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
    """Return the command for a signed speed, with a target at infinity."""
    return MotionCommand(math.copysign(math.inf, speed_deg_s), abs(speed_deg_s), rate_deg_s2)


def _error_of(choice: Choice, before: Before, step: Step, least: float) -> float:
    """Return the error of a choice, or a part of it that already exceeds `least`."""
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
    """Yield commands near those that would reach the end of a step exactly, without the limited resolution.

    For each S, the travel determines the middle of the ramp. Then A determines the time of the command: the ramp may
    last as long as the step, or be as short as the run-on requires.
    """
    begin, unchanged = before(step.begin_s), before(step.end_s)
    missing_deg = step.end.angle_deg - unchanged.angle_deg
    unfinished = 2.0 * abs(missing_deg) / step.duration_s**2
    speeds = _speeds(unchanged.speed_deg_s, missing_deg, step, grid)
    for top in sorted(speeds, key=lambda speed: abs(speed - step.end.speed_deg_s)):
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
    """Return the signed S to try: near the plan's, and those that compensate a position error.

    The ramp may be at once, as late as possible, or in the middle of the step.
    """
    speeds = {*grid.speeds_around(step.end.speed_deg_s, _SPEEDS)}
    for left_s in (step.end_s - step.earliest_s, step.end_s - step.latest_s, 0.5 * step.duration_s):
        if left_s > 0.0:
            speeds.update(grid.speeds_around(unchanged_deg_s + missing_deg / left_s, 1))
    return speeds


def _rates(change_deg_s: float, middle_s: float, step: Step) -> Iterator[float]:
    """Yield values of A for ramps with a given middle that start or end with the step, or at the first or last time."""
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

    If the plan stands, the table stands at the nearest number. It does not alternate between two numbers around the
    plan.
    """
    shifts = (0,) if step.stands else (-1, 0, 1)
    left_s = step.end_s - step.earliest_s
    way = abs(step.end.angle_deg - start.angle_deg)
    braking = 0.5 * start.speed_deg_s**2 / way if way > 0.0 else abs(start.speed_deg_s) / left_s
    for target in (grid.nearest(step.end.angle_deg + shift * grid.quantum) for shift in shifts):
        for speed in (grid.speed(abs(start.speed_deg_s)), grid.speed(abs(start.speed_deg_s) + grid.quantum)):
            for rate in (*grid.rates_around(braking), *grid.rates_around(1.2 * braking), grid.rate(10.0 * braking)):
                yield Choice(step.earliest_s, MotionCommand(target, speed, rate))
