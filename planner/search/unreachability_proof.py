"""Prove that a map cannot be crossed: a superset of the reachable states is empty in some column.

Speeds are grouped into cells. For each column and cell, consider the angles that any motion within the limits can have
there, at any speed of the cell. They are in a union of intervals. A step widens it by the minimum and maximum travel of
a motion from one cell to the other. A run of samples that are allowed in both columns clips it. All sets are rounded
outward, by far more than the allowed deviation of a plan. So if all of them are empty, no motion exists. The converse
need not be true, because a cell does not store which speed belongs to which angle. Smaller cells are more accurate.
"""

from typing import NamedTuple

import numpy as np

from planner.arrays import FloatArray, IndexArray
from planner.kernel import kernel
from planner.plans.problem import Problem, Terms
from planner.plans.verification import ROUNDING
from planner.search.crossable_intervals import runs_of
from planner.search.interval_union import unite

# Tolerances: for limits (relative, as in the check of a plan), and for runs and travel (in samples).
LIMIT_MARGIN = 1e-7
SAMPLE_MARGIN = 1e-6

# Maximum number of pairs of an interval and a run, about a second: a longer proof is abandoned.
MOST_WORK = 100_000_000

# Factor by which the cells are smaller that find the location, once there is a proof.
FINER = 4


class Reachable(NamedTuple):
    """Reachable angles of a column, in samples, per cell of speed.

    Attributes:
        slowest: lower bound of the speeds.
        fastest: upper bound of the speeds.
        interval_count: (n_cells,) number of intervals of each cell.
        lows: (n_cells, room) their lower ends.
        highs: (n_cells, room) their upper ends.
    """

    slowest: float
    fastest: float
    interval_count: IndexArray
    lows: FloatArray
    highs: FloatArray


class Widening(NamedTuple):
    """The effect of steps from one cell to another, in samples.

    Attributes:
        least: minimum travel.
        most: maximum travel.
        beyond_start: minimum distance beyond its start at which each of them reverses; upward if positive.
        beyond_end: the same, beyond its end.
    """

    least: float
    most: float
    beyond_start: float
    beyond_end: float


def first_unreachable_location(problem: Problem, cell_count: int) -> int | None:
    """Return the first location that no motion from the start reaches; None without a proof.

    Args:
        problem: the problem; a free start means all angles, or all speeds.
        cell_count: number of cells of speed for the proof; smaller cells find the location.
    """
    location = _first_empty_column(problem, cell_count)
    if location is None:
        return None
    finer = _first_empty_column(problem, FINER * cell_count)
    return location if finer is None else finer


def _first_empty_column(problem: Problem, cell_count: int) -> int | None:
    limit = problem.limits.speed_deg_s * (1.0 + LIMIT_MARGIN) + ROUNDING
    edges = np.linspace(-limit, limit, cell_count + 1)
    slowest, fastest = (-limit, limit) if problem.start_speed_deg_s is None else (problem.start_speed_deg_s,) * 2
    turn = float(problem.map.angle_count)
    low = 0.0 if problem.start_angle_deg is None else problem.start_angle_deg * turn / 360.0 % turn
    high = turn if problem.start_angle_deg is None else low
    start = Reachable(
        float(slowest),
        float(fastest),
        ((edges[:-1] <= fastest) & (edges[1:] >= slowest)).astype(np.int64),
        np.full((cell_count, 1), low),
        np.full((cell_count, 1), high),
    )
    column = _first_empty(problem.terms, edges, start)
    return column if column >= 0 else None


@kernel
def _first_empty(terms: Terms, edges: FloatArray, start: Reachable) -> int:
    """Return the first column in which nothing can be reached; -1 if there is none, or if it is unknown."""
    reachable, work = start, 0.0
    cells_in_a_step = 2.0 * terms.acceleration_limit_deg_s2 * terms.step_s / (edges[1] - edges[0]) + 3.0
    cells_in_a_step = min(cells_in_a_step, float(len(edges) - 1))
    for k in range(len(terms.values) - 1):
        run_count = 1
        for i in range(terms.runs.shape[1]):
            run_count += terms.runs[k, i] > 0 and terms.runs[k, i - 1] == 0
        work += reachable.interval_count.sum() * cells_in_a_step * run_count
        if work > MOST_WORK:
            return -1
        reachable = _step(terms, edges, k, reachable)
        if reachable.interval_count.max() == 0:
            return k + 1
    return -1


@kernel
def _step(terms: Terms, edges: FloatArray, column: int, now: Reachable) -> Reachable:
    """Return the reachable angles of the next column."""
    turn, cells = float(terms.values.shape[1]), len(edges) - 1
    gain = (terms.acceleration_limit_deg_s2 * (1.0 + LIMIT_MARGIN) + ROUNDING) * terms.step_s
    scale = 0.5 * terms.step_s * turn / 360.0
    slowest, fastest = max(now.slowest - gain, edges[0]), min(now.fastest + gain, edges[-1])
    run_lows, run_highs = runs_of(terms.runs, column)
    count = np.zeros(cells, dtype=np.int64)
    lows, highs = np.empty((cells, now.lows.shape[1])), np.empty((cells, now.lows.shape[1]))
    # For disjoint intervals and disjoint runs, few pairs overlap twice around the turn.
    room = 4 * now.interval_count.sum() * (len(run_lows) + 1)
    piece_lows, piece_highs = np.empty(room), np.empty(room)
    for later in range(cells):
        later_low, later_high = max(edges[later], slowest), min(edges[later + 1], fastest)
        pieces = 0
        for c in range(cells):
            low, high = max(edges[c], now.slowest), min(edges[c + 1], now.fastest)
            if low > high or later_low > later_high or later_low > high + gain or later_high < low - gain:
                continue
            widening = widening_between(low, high, later_low, later_high, gain, scale)
            for i in range(now.interval_count[c]):
                pieces = _widen(
                    widening,
                    now.lows[c, i],
                    now.highs[c, i],
                    run_lows,
                    run_highs,
                    turn,
                    piece_lows,
                    piece_highs,
                    pieces,
                )
        pieces = unite(piece_lows, piece_highs, pieces, turn)
        if pieces > lows.shape[1]:
            lows, highs = _with_more_room(lows, 2 * pieces), _with_more_room(highs, 2 * pieces)
        count[later] = pieces
        for i in range(pieces):
            lows[later, i], highs[later, i] = piece_lows[i], piece_highs[i]
    return Reachable(slowest, fastest, count, lows, highs)


@kernel
def widening_between(
    low: float, high: float, later_low: float, later_high: float, gain: float, scale: float
) -> Widening:
    """Return the effect of steps from a speed of one cell to a speed of another that is at most `gain` away."""
    least = max(low, later_low - gain) + max(later_low, low - gain)
    most = min(high, later_high + gain) + min(later_high, high + gain)
    return Widening(
        least * scale - SAMPLE_MARGIN,
        most * scale + SAMPLE_MARGIN,
        _least_turn(low, high, later_low, later_high) * scale,
        _least_turn(-later_high, -later_low, -high, -low) * scale,
    )


@kernel
def _least_turn(low: float, high: float, later_low: float, later_high: float) -> float:
    """Return the minimum distance beyond its start at which a step reverses, times 2 / dt; upward if positive."""
    if low > 0.0 and later_high < 0.0:
        return low * low / (low - later_low)
    if high < 0.0 and later_low > 0.0:
        return -high * high / (later_high - high)
    return 0.0


@kernel
def _with_more_room(array: FloatArray, room: int) -> FloatArray:
    larger = np.empty((len(array), room))
    for row in range(len(array)):
        for i in range(array.shape[1]):  # the assignment of slices brings its texts of errors into the machine code
            larger[row, i] = array[row, i]
    return larger


@kernel
def _widen(
    widening: Widening,
    low: float,
    high: float,
    run_lows: FloatArray,
    run_highs: FloatArray,
    turn: float,
    piece_lows: FloatArray,
    piece_highs: FloatArray,
    pieces: int,
) -> int:
    """Append the angles to which steps lead from an interval; return the new number of pieces."""
    if len(run_lows) == 1 and run_highs[0] - run_lows[0] >= turn:
        return _append(low + widening.least, high + widening.most, turn, piece_lows, piece_highs, pieces)
    above_start, below_start = max(widening.beyond_start, 0.0), max(-widening.beyond_start, 0.0)
    above_end, below_end = max(widening.beyond_end, 0.0), max(-widening.beyond_end, 0.0)
    for r in range(len(run_lows)):
        run_low, run_high = run_lows[r] - SAMPLE_MARGIN, run_highs[r] + SAMPLE_MARGIN
        turned = turn * np.ceil((low - run_high) / turn)
        while run_low + turned <= high:
            start_low, start_high = max(low, run_low + turned + below_start), min(high, run_high + turned - above_start)
            end_low = max(start_low + widening.least, run_low + turned + below_end)
            end_high = min(start_high + widening.most, run_high + turned - above_end)
            if start_low <= start_high and end_low <= end_high:
                pieces = _append(end_low, end_high, turn, piece_lows, piece_highs, pieces)
            turned += turn
    return pieces


@kernel
def _append(low: float, high: float, turn: float, piece_lows: FloatArray, piece_highs: FloatArray, pieces: int) -> int:
    """Append an interval, shifted so that its lower end is within 0 .. turn."""
    back = turn * np.floor(low / turn)
    piece_lows[pieces], piece_highs[pieces] = low - back, high - back
    return pieces + 1
