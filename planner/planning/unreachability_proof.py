"""Prove that a map cannot be crossed: a superset of the states that can be reached, which is empty somewhere.

Speeds are gathered into cells. For each column and cell, the angles that any motion within the limits can have there,
at any speed of the cell, lie in a union of intervals: a step widens it by the least and the greatest angle that a
motion from one cell to the other moves, and a run of samples that are allowed in both columns clips it. All sets are
rounded outwards, by far more than what a plan may deviate. So where all of them are empty no motion exists; the reverse
need not hold, since the cells forget which speed belongs to which angle. Smaller cells forget less.
"""

import numpy as np

from planner.arrays import FloatArray
from planner.kernel import kernel
from planner.planning.crossable_intervals import runs_of
from planner.planning.interval_union import unite
from planner.planning.problem import Problem, Terms

# By how much limits (relative) and runs and ways (in samples) are widened; plans keep them within 1e-9.
LIMIT_MARGIN = 1e-7
SAMPLE_MARGIN = 1e-6


def first_unreachable_location(problem: Problem, cell_count: int) -> int | None:
    """Return the first location that no motion from the start reaches, if that can be proved with so many cells.

    Args:
        problem: what is to be crossed; a free start means all angles, or all speeds.
        cell_count: cells of speed.
    """
    limit = problem.limits.speed_deg_s * (1.0 + LIMIT_MARGIN)
    edges = np.linspace(-limit, limit, cell_count + 1)
    speeds = (-limit, limit) if problem.start_speed_deg_s is None else (problem.start_speed_deg_s,) * 2
    angle = problem.start_angle_deg
    turn = float(problem.map.angle_count)
    low = 0.0 if angle is None else angle * turn / 360.0 % turn
    reach = turn if angle is None else 0.0
    location = _first_empty(problem.terms, edges, float(speeds[0]), float(speeds[1]), low, reach)
    return location if location >= 0 else None


@kernel
def _first_empty(terms: Terms, edges: FloatArray, slowest: float, fastest: float, start: float, length: float) -> int:
    """Return the first column in which no state is left; -1 where some are left in all."""
    steps, turn = len(terms.values) - 1, float(terms.values.shape[1])
    gain = terms.acceleration_limit_deg_s2 * terms.step_s * (1.0 + LIMIT_MARGIN)
    cells = len(edges) - 1
    count, later_count = np.zeros(cells, dtype=np.int64), np.zeros(cells, dtype=np.int64)
    lows, highs = np.empty((cells, 8)), np.empty((cells, 8))
    later_lows, later_highs = np.empty((cells, 8)), np.empty((cells, 8))
    for c in range(cells):
        if edges[c] <= fastest + LIMIT_MARGIN and edges[c + 1] >= slowest - LIMIT_MARGIN:
            count[c], lows[c, 0], highs[c, 0] = 1, start, start + length
    room = 1024
    piece_lows, piece_highs = np.empty(room), np.empty(room)
    for k in range(steps):
        run_lows, run_highs = runs_of(terms.runs, k)
        left = False
        for d in range(cells):
            later_slowest = max(edges[d], slowest - gain)
            later_fastest = min(edges[d + 1], fastest + gain)
            pieces = 0
            for c in range(cells):
                if count[c] == 0 or later_slowest > later_fastest:
                    continue
                low, high = max(edges[c], slowest), min(edges[c + 1], fastest)
                if later_slowest > high + gain or later_fastest < low - gain or low > high:
                    continue
                least = max(low, later_slowest - gain) + max(later_slowest, low - gain)
                most = min(high, later_fastest + gain) + min(later_fastest, high + gain)
                scale = 0.5 * terms.step_s * turn / 360.0
                need = pieces + 2 * count[c] * (len(run_lows) + 2) * (3 + int((most - least) * scale / turn))
                if need > len(piece_lows):
                    piece_lows = np.concatenate((piece_lows, np.empty(need)))
                    piece_highs = np.concatenate((piece_highs, np.empty(need)))
                beyond = _least_turn(low, high, later_slowest, later_fastest) * scale
                before = _least_turn(-later_fastest, -later_slowest, -high, -low) * scale
                pieces = _step(
                    beyond,
                    before,
                    least * scale - SAMPLE_MARGIN,
                    most * scale + SAMPLE_MARGIN,
                    lows[c, : count[c]],
                    highs[c, : count[c]],
                    run_lows,
                    run_highs,
                    turn,
                    piece_lows,
                    piece_highs,
                    pieces,
                )
            pieces = unite(piece_lows, piece_highs, pieces, turn)
            if pieces > later_lows.shape[1]:
                later_lows = _wider(later_lows, 2 * pieces)
                later_highs = _wider(later_highs, 2 * pieces)
            later_lows[d, :pieces], later_highs[d, :pieces] = piece_lows[:pieces], piece_highs[:pieces]
            later_count[d] = pieces
            left = left or pieces > 0
        if not left:
            return k + 1
        lows, later_lows = later_lows, lows
        highs, later_highs = later_highs, highs
        count, later_count = later_count, count
        if later_lows.shape[1] < lows.shape[1]:
            later_lows, later_highs = np.empty(lows.shape), np.empty(lows.shape)
        slowest, fastest = max(slowest - gain, edges[0]), min(fastest + gain, edges[-1])
    return -1


@kernel
def _least_turn(low: float, high: float, later_low: float, later_high: float) -> float:
    """Return how far beyond its start a step turns back at least, times 2 / dt; upwards if positive."""
    if low > 0.0 and later_high < 0.0:
        return low * low / (low - later_low)
    if high < 0.0 and later_low > 0.0:
        return -high * high / (later_high - high)
    return 0.0


@kernel
def _wider(array: FloatArray, width: int) -> FloatArray:
    wider = np.empty((len(array), width))
    wider[:, : array.shape[1]] = array
    return wider


@kernel
def _step(
    beyond: float,
    before: float,
    least: float,
    most: float,
    lows: FloatArray,
    highs: FloatArray,
    run_lows: FloatArray,
    run_highs: FloatArray,
    turn: float,
    piece_lows: FloatArray,
    piece_highs: FloatArray,
    pieces: int,
) -> int:
    """Append the angles to which steps that move between `least` and `most` lead from given intervals."""
    whole = len(run_lows) > 0 and run_highs[0] - run_lows[0] >= turn
    for i in range(len(lows)):
        for r in range(len(run_lows)):
            run_low, run_high = run_lows[r] - SAMPLE_MARGIN, run_highs[r] + SAMPLE_MARGIN
            turned = 0.0 if whole else turn * np.ceil((lows[i] - run_high) / turn)
            while whole or run_low + turned <= highs[i]:
                if whole:
                    low, high = lows[i] + least, highs[i] + most
                else:
                    low = max(lows[i], run_low + turned + max(-beyond, 0.0))
                    high = min(highs[i], run_high + turned - max(beyond, 0.0))
                    if low > high:
                        turned += turn
                        continue
                    low = max(low + least, run_low + turned + max(-before, 0.0))
                    high = min(high + most, run_high + turned - max(before, 0.0))
                if low <= high:
                    back = turn * np.floor(low / turn)
                    piece_lows[pieces], piece_highs[pieces] = low - back, high - back
                    pieces += 1
                if whole:
                    break
                turned += turn
    return pieces
