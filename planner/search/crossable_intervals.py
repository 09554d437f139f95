"""Compute exactly, without a grid of angles, from which angles the rest of the map can be crossed.

For a column and a speed, these angles are a union of intervals. A step to another speed shifts the intervals of the
next column back by its travel. A run of samples that are allowed in both columns clips them. Only the speeds are on a
grid. This finds paths that no lattice has: close to the limits, or through gaps that a lattice passes at only one
speed.
"""

from typing import NamedTuple

import numpy as np

from planner.arrays import FloatArray, IndexArray
from planner.kernel import kernel
from planner.map.config_map import SAMPLE_TOLERANCE, column_value
from planner.plans.crossing import RunArray, step_is_allowed
from planner.plans.problem import Problem, Terms
from planner.search.interval_union import contains, unite
from planner.table.cost import acceleration_cost, speed_cost, value_cost
from planner.table.motion import Motion, next_angle, swept_angles

# Tolerances in samples: a run is longer by the first, and an angle may be outside an interval by the second.
LONGER = 0.2 * SAMPLE_TOLERANCE
OUTSIDE = 0.4 * SAMPLE_TOLERANCE
ROUNDING = 1e-9

# 32 MB: speeds that split the angles into more intervals are omitted, and more speeds would take too long.
MOST_INTERVALS = 2_000_000
MOST_SPEEDS = 1_000

# Maximum number of pairs of an interval and a run, about a second.
MOST_WORK = 100_000_000


class Crossable(NamedTuple):
    """The crossable angles per column and speed.

    Attributes:
        speeds_deg_s: (n_speeds,) ascending.
        first: (n + 1, n_speeds) index of the first interval of a column and speed.
        interval_count: (n + 1, n_speeds) number of its intervals.
        lows: lower ends, in samples from 0 up to a turn.
        highs: upper ends.
    """

    speeds_deg_s: FloatArray
    first: IndexArray
    interval_count: IndexArray
    lows: FloatArray
    highs: FloatArray


def crossing_motion(problem: Problem, speeds_per_gain: int) -> Motion | None:
    """Return a motion across the map from the problem's start, not optimized; None if these speeds have none.

    Args:
        problem: the problem.
        speeds_per_gain: number of speeds within the change that the acceleration limit allows in a step; limits and
            start are added.
    """
    speeds_deg_s = speeds_of(problem, speeds_per_gain)
    if len(speeds_deg_s) > MOST_SPEEDS:
        return None
    crossable = crossable_intervals(problem.terms, speeds_deg_s)
    start = _start(problem, crossable)
    if start is None:
        return None
    motion = follow(problem.terms, crossable, *start)
    return motion if len(motion.accelerations_deg_s2) > 0 else None


def speeds_of(problem: Problem, speeds_per_gain: int) -> FloatArray:
    """Return the speeds to use: multiples of a fraction of the change in one step, both limits, and the start."""
    limit, gain = problem.limits.speed_deg_s, problem.limits.acceleration_deg_s2 * problem.step_s
    step = min(gain, limit) / speeds_per_gain
    positive = np.arange(int(problem.attainable_speed_deg_s / step + ROUNDING) + 1) * step
    start = [] if problem.start_speed_deg_s is None else [problem.start_speed_deg_s]
    speeds = np.unique(np.concatenate((-positive, positive, [-limit, limit], start)))
    return speeds[np.concatenate(([True], np.diff(speeds) > ROUNDING * limit)) | np.isin(speeds, start)]


def _start(problem: Problem, crossable: Crossable) -> tuple[float, int] | None:
    """Return a start from which the map can be crossed.

    If the angle is free, it is the middle of the widest interval.
    """
    turn, start_speed = float(problem.map.angle_count), problem.start_speed_deg_s
    best, widest = None, -1.0
    for s in range(len(crossable.speeds_deg_s)):
        if start_speed is not None and crossable.speeds_deg_s[s] != start_speed:
            continue
        intervals = slice(crossable.first[0, s], crossable.first[0, s] + crossable.interval_count[0, s])
        lows, highs = crossable.lows[intervals], crossable.highs[intervals]
        if problem.start_angle_deg is not None:
            position = problem.start_angle_deg * turn / 360.0 % turn
            if contains(lows, highs, position, turn, OUTSIDE):
                return problem.start_angle_deg, s
        elif len(lows) > 0 and (highs - lows).max() > widest:
            at = int(np.argmax(highs - lows))
            widest = float(highs[at] - lows[at])
            best = 0.5 * float(lows[at] + highs[at]) * 360.0 / turn, s
    return best


@kernel
def runs_of(runs: RunArray, step: int) -> tuple[FloatArray, FloatArray]:
    """Return first and last sample of each run that is allowed during the whole step; (0, a turn) for a whole turn."""
    count: int = runs.shape[1]
    lows, highs = np.empty(count), np.empty(count)
    found = 0
    if runs[step, 0] > count:
        return np.zeros(1), np.full(1, float(count))
    for i in range(count):
        if runs[step, i] > 0 and runs[step, i - 1] == 0:
            lows[found], highs[found] = i, i + runs[step, i] - 1.0
            found += 1
    return lows[:found], highs[:found]


@kernel
def crossable_intervals(terms: Terms, speeds_deg_s: FloatArray) -> Crossable:
    """Return the angles from which the rest can be crossed, per column and speed, in steps between given speeds."""
    steps, speeds, turn = len(terms.values) - 1, len(speeds_deg_s), float(terms.values.shape[1])
    first, count = np.zeros((steps + 1, speeds), dtype=np.int64), np.zeros((steps + 1, speeds), dtype=np.int64)
    lows, highs, end = np.zeros(1024), np.full(1024, turn), 1
    count[steps] = 1
    work, gain = 0, terms.acceleration_limit_deg_s2 * terms.step_s * (1.0 + ROUNDING)
    for k in range(steps - 1, -1, -1):
        run_lows, run_highs = runs_of(terms.runs, k)
        for s in range(speeds):
            work += (count[k + 1] * (np.abs(speeds_deg_s - speeds_deg_s[s]) <= gain)).sum() * (len(run_lows) + 1)
        if work > MOST_WORK:
            break
        for s in range(speeds):
            piece_lows, piece_highs = _leave(
                terms, speeds_deg_s, s, first[k + 1], count[k + 1], lows, highs, run_lows, run_highs
            )
            pieces = len(piece_lows)
            while end + pieces > len(lows):
                lows, highs = np.concatenate((lows, np.empty(len(lows)))), np.concatenate((highs, np.empty(len(highs))))
            lows[end : end + pieces], highs[end : end + pieces] = piece_lows, piece_highs
            first[k, s], count[k, s] = end, pieces
            end += pieces
        if count[k].max() == 0 or end > MOST_INTERVALS:
            break
    return Crossable(speeds_deg_s, first, count, lows[:end], highs[:end])


@kernel
def _leave(
    terms: Terms,
    speeds_deg_s: FloatArray,
    s: int,
    first: IndexArray,
    count: IndexArray,
    lows: FloatArray,
    highs: FloatArray,
    run_lows: FloatArray,
    run_highs: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Return the crossable angles of a column at speed s, given `first` and `count` of the next column's intervals."""
    gain = terms.acceleration_limit_deg_s2 * terms.step_s * (1.0 + ROUNDING)
    is_near = np.abs(speeds_deg_s - speeds_deg_s[s]) <= gain
    # For disjoint intervals and disjoint runs, few pairs overlap twice around the turn.
    room = 4 * (count * is_near).sum() * (len(run_lows) + 1)
    piece_lows, piece_highs = np.empty(room), np.empty(room)
    pieces = 0
    for t in np.flatnonzero(is_near):
        intervals = slice(first[t], first[t] + count[t])
        pieces = _step_back(
            terms,
            speeds_deg_s[s],
            speeds_deg_s[t],
            lows[intervals],
            highs[intervals],
            run_lows,
            run_highs,
            piece_lows,
            piece_highs,
            pieces,
        )
    pieces = unite(piece_lows, piece_highs, pieces, float(terms.values.shape[1]))
    return piece_lows[:pieces], piece_highs[:pieces]


@kernel
def _step_back(
    terms: Terms,
    speed: float,
    later: float,
    lows: FloatArray,
    highs: FloatArray,
    run_lows: FloatArray,
    run_highs: FloatArray,
    piece_lows: FloatArray,
    piece_highs: FloatArray,
    pieces: int,
) -> int:
    """Append the angles from which a step between two speeds ends in given intervals; return the new count."""
    turn = float(terms.values.shape[1])
    samples_per_deg = turn / 360.0
    acceleration = (later - speed) / terms.step_s
    lowest, highest = swept_angles(0.0, speed, acceleration, terms.step_s)
    lowest, highest = lowest * samples_per_deg, highest * samples_per_deg
    moved = 0.5 * (speed + later) * terms.step_s * samples_per_deg
    whole = run_highs[0] - run_lows[0] >= turn if len(run_lows) > 0 else False
    for i in range(len(lows)):
        low, length = lows[i] - moved, highs[i] - lows[i]
        low -= turn * np.floor(low / turn)
        if whole:
            piece_lows[pieces], piece_highs[pieces] = low, low + length
            pieces += 1
            continue
        for r in range(len(run_lows)):
            run_low, run_high = run_lows[r] - LONGER - lowest, run_highs[r] + LONGER - highest
            if run_low > run_high:
                continue
            # The copy of the run that is the first to end above `low`, and the following ones that start below `high`.
            turned = turn * np.ceil((low - run_high) / turn)
            while run_low + turned <= low + length:
                piece_low, piece_high = max(low, run_low + turned), min(low + length, run_high + turned)
                back = turn * np.floor(piece_low / turn)
                piece_lows[pieces], piece_highs[pieces] = piece_low - back, piece_high - back
                pieces += 1
                turned += turn
    return pieces


@kernel
def follow(terms: Terms, crossable: Crossable, angle_deg: float, speed: int) -> Motion:
    """Return a motion across the map from a crossable state: at each step, the cheapest one that stays crossable."""
    steps, speeds_deg_s = len(terms.values) - 1, crossable.speeds_deg_s
    angles, speeds, accelerations = np.empty(steps + 1), np.empty(steps + 1), np.empty(steps)
    angles[0], speeds[0] = angle_deg, speeds_deg_s[speed]
    for k in range(steps):
        least, best = np.inf, -1
        for t in range(len(speeds_deg_s)):
            cost = _cost(terms, crossable, k, angles[k], speeds[k], t)
            if cost < least:
                least, best = cost, t
        if best < 0:
            return Motion(angles[:0], speeds[:0], accelerations[:0])
        accelerations[k] = (speeds_deg_s[best] - speeds[k]) / terms.step_s
        angles[k + 1] = next_angle(angles[k], speeds[k], accelerations[k], terms.step_s)
        speeds[k + 1] = speeds_deg_s[best]
    return Motion(angles, speeds, accelerations)


@kernel
def _cost(terms: Terms, crossable: Crossable, column: int, angle_deg: float, speed_deg_s: float, t: int) -> float:
    """Return the cost of the step from a state to speed t; infinity if it is not allowed or has no continuation."""
    later = crossable.speeds_deg_s[t]
    turn = float(terms.values.shape[1])
    acceleration = (later - speed_deg_s) / terms.step_s
    if abs(acceleration) > terms.acceleration_limit_deg_s2 * (1.0 + ROUNDING):
        return np.inf
    end_deg = next_angle(angle_deg, speed_deg_s, acceleration, terms.step_s)
    position = end_deg * turn / 360.0
    position -= turn * np.floor(position / turn)
    first = crossable.first[column + 1, t]
    last = first + crossable.interval_count[column + 1, t]
    if not contains(crossable.lows[first:last], crossable.highs[first:last], position, turn, OUTSIDE):
        return np.inf
    if not step_is_allowed(terms.runs, column, angle_deg, speed_deg_s, acceleration, terms.step_s):
        return np.inf
    value = column_value(terms.values, terms.epsilon, column + 1, end_deg)
    return (
        acceleration_cost(terms.acceleration_weight, acceleration)
        + speed_cost(terms.speed_weight, later)
        + value_cost(value)
    )
