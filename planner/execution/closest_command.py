"""The command that brings the reference nearest to the plan in one step, of those that the wire can say.

In a step the reference goes from its present speed towards S at the rate A, and then holds S. P only gives the
direction, but the controller brakes for it, so it lies beyond the way to stop. It does not lie farther than that: if
the line dies, the table runs on to P and stands there.
"""

import math
from collections.abc import Iterator

from planner.execution.table_motion import Leg
from planner.table.velocity_profile import MotionCommand, ReferenceState, advance, move
from planner.table.wire import Grid

# A speed below this counts as standing: it is what additions leave of zero.
STANDING_DEG_S = 1e-6
# What a deg of error at the end of a step is weighed against: half as much in its middle; the way that an error of the
# end's speed makes in a third of a step; and, in the smallest number a degree, the way that the table runs on when the
# line dies, so that of equals the one is taken which stops soonest.
_MIDDLE_WEIGHT = 0.5
_SPEED_WEIGHT = 0.3
_RUN_ON_WEIGHT = 1e-4
_SHORT_RUN_ON_DEG = 90.0


def latest_s(duration_s: float) -> float:
    """Return how late the command after a step may come before the table brakes for the target of the step."""
    return max(0.1, 0.5 * duration_s)


def closest_command(state: ReferenceState, leg: Leg, grid: Grid) -> MotionCommand:
    """Return the command that brings the reference nearest to the plan by the end of a leg."""
    middle, end = (leg.state_at(leg.start_s + share * leg.duration_s) for share in (0.5, 1.0))
    chosen, least = None, math.inf
    for speed, rate in _candidates(state, end, leg.duration_s, grid):
        there = _ramp(state, speed, rate, leg.duration_s)
        error = _error(_ramp(state, speed, rate, 0.5 * leg.duration_s), there, middle, end, leg.duration_s)
        error += (_RUN_ON_WEIGHT * grid.quantum * 0.5 * there.speed_deg_s**2 / rate) ** 2
        if error < least:
            chosen, least = (speed, rate), error
    assert chosen is not None
    command = command_towards(state, *chosen, leg.duration_s, grid)
    if abs(end.speed_deg_s) > STANDING_DEG_S:
        return command
    for stop in _stops(state, end, leg.duration_s, grid):
        half, full = (advance(state, stop, share * leg.duration_s) for share in (0.5, 1.0))
        error = _error(half, full, middle, end, leg.duration_s)
        if error < least:
            command, least = stop, error
    return command


def _candidates(
    state: ReferenceState, end: ReferenceState, duration_s: float, grid: Grid
) -> Iterator[tuple[float, float]]:
    """Yield signed S, and A, around those that would meet the end of a step if any number could be said.

    Either the ramp is over before the step is: then the way, S T - (S - v)^2 / 2A, says A. Or it is not: then the way
    is v T + A T^2 / 2. Or A is simply that of the plan, or one that soon stops a table whose line died.
    """
    way = end.angle_deg - state.angle_deg
    speed = state.speed_deg_s
    unfinished = 2.0 * abs(way - speed * duration_s) / duration_s**2
    planned = abs(end.speed_deg_s - speed) / duration_s
    for top in grid.speeds_around(end.speed_deg_s, 4):
        lag = abs(top * duration_s - way)
        finished = 0.5 * (top - speed) ** 2 / lag if lag > 0.0 else math.inf
        for rate in (finished, unfinished, planned, 0.5 * top**2 / _SHORT_RUN_ON_DEG):
            for number in grid.rates_around(rate):
                yield top, number


def _stops(state: ReferenceState, end: ReferenceState, duration_s: float, grid: Grid) -> Iterator[MotionCommand]:
    """Yield commands that bring the reference to rest, near the end of a step that ends at rest."""
    way = abs(end.angle_deg - state.angle_deg)
    mean = abs(state.speed_deg_s) / duration_s
    braking = 0.5 * state.speed_deg_s**2 / way if way > 0.0 else mean
    for target in (grid.nearest(end.angle_deg + shift * grid.quantum) for shift in (-1, 0, 1)):
        for speed in (grid.speed(abs(state.speed_deg_s)), grid.speed(abs(state.speed_deg_s) + grid.quantum)):
            for rate in (*grid.rates_around(braking), *grid.rates_around(1.2 * braking), grid.rate(10.0 * braking)):
                yield MotionCommand(target, speed, rate)


def _error(
    middle: ReferenceState,
    end: ReferenceState,
    planned_middle: ReferenceState,
    planned_end: ReferenceState,
    duration_s: float,
) -> float:
    """Return the squared error of a step, in deg^2."""
    return (
        (end.angle_deg - planned_end.angle_deg) ** 2
        + (_MIDDLE_WEIGHT * (middle.angle_deg - planned_middle.angle_deg)) ** 2
        + (_SPEED_WEIGHT * duration_s * (end.speed_deg_s - planned_end.speed_deg_s)) ** 2
    )


def _ramp(state: ReferenceState, speed_deg_s: float, rate_deg_s2: float, duration_s: float) -> ReferenceState:
    """Return where the reference gets that goes to a signed speed at a rate, and holds it; its target is far away."""
    change = speed_deg_s - state.speed_deg_s
    ramp_s = abs(change) / rate_deg_s2
    acceleration = math.copysign(rate_deg_s2, change)
    if duration_s <= ramp_s:
        return move(state, acceleration, duration_s)
    reached = move(state, acceleration, ramp_s)
    return ReferenceState(reached.angle_deg + speed_deg_s * (duration_s - ramp_s), speed_deg_s)


def command_towards(
    state: ReferenceState, speed_deg_s: float, rate_deg_s2: float, duration_s: float, grid: Grid
) -> MotionCommand:
    """Return the command of a signed speed, with the nearest target for which the table does not brake too soon."""
    forward = math.copysign(1.0, speed_deg_s)
    late = _ramp(state, speed_deg_s, rate_deg_s2, duration_s + latest_s(duration_s))
    farthest = forward * state.angle_deg
    if forward * late.speed_deg_s > 0.0:
        farthest = max(farthest, forward * late.angle_deg + 0.5 * late.speed_deg_s**2 / rate_deg_s2)
    return MotionCommand(grid.beyond(forward * farthest, forward), abs(speed_deg_s), rate_deg_s2)
