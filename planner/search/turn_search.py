"""The best path through a lattice that the arm can follow: the turns of its joints are part of the state.

Dijkstra's search over columns, forward. If it ends early, the first location without a path is known, and the joint
that bars the path. A state is (turns, speed i, q). `lattice.py` defines angles, speeds and steps, and `joint_turns.py`
the turns. The moves are taken run by run (`node_joints.py`), so that the innermost loop is along q, contiguous and
without branches.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from planner.arrays import BoolArray, FloatArray, IndexArray
from planner.kernel import kernel
from planner.plans.problem import Problem, Terms
from planner.reasons import Reason
from planner.search.joint_turns import BARS, Turns, count_bar, fitting, turn_change
from planner.search.lattice import (
    ANY_COST,
    Lattice,
    StepRows,
    cost_unit,
    lay_out_step,
    make_rows,
    margin,
    motion_along,
    speed_unit,
)
from planner.search.lattice_cost_to_go import TURN_ROUNDING, steps_from
from planner.search.node_joints import Runs, arrival_costs, gather_runs, reach
from planner.table.cost import acceleration_cost, speed_cost
from planner.table.motion import Motion

ChoiceArray = npt.NDArray[np.uint8]

# A choice is the speed before the step, in one byte.
MOST_SPEEDS = 255
_NO_CHOICE = MOST_SPEEDS


class NotFound(NamedTuple):
    """The first location that no motion on the lattice reaches, and the limit of the arm that bars the path, if any."""

    location: int
    limit: Reason | None


def find_path(
    problem: Problem, lattice: Lattice, joints: FloatArray, turns: Turns, starts: BoolArray
) -> Motion | NotFound:
    """Return the motion of minimum cost on a lattice that the arm can follow.

    Args:
        problem: the problem.
        lattice: with at most MOST_SPEEDS speeds.
        joints: from `node_joints`.
        turns: limits of the arm.
        starts: (n_speeds, n_q) the possible starts, on any turn.
    """
    shape = len(turns.turns), 2 * lattice.half_count + 1, lattice.q_count
    choices = np.empty((problem.step_count, *shape), dtype=np.uint8)
    now, later = _start_costs(problem, lattice, joints[0], turns, starts), np.empty(shape)
    rows, alive = make_rows(lattice), [np.isfinite(now)]
    if not alive[0].any():
        return NotFound(0, None)
    for k in range(problem.step_count):
        lay_out_step(problem.terms, _up_to(lattice, k + 1), k, rows)
        runs = gather_runs(lattice, turns, joints[k], joints[k + 1])
        arrivals = arrival_costs(lattice, turns, joints[k + 1], rows)
        _advance(problem.terms, lattice, k, turns, runs, rows, arrivals, now, later, choices[k])
        now, later = later, now
        if not np.isfinite(now).any():
            return NotFound(k + 1, _first_bar(problem.terms, lattice, turns, joints, alive))
        alive.append(choices[k] != _NO_CHOICE)
    c, s, q = (int(place) for place in np.unravel_index(int(np.argmin(now)), shape))
    first_q, speeds = _backtrack(lattice, turns, joints, choices, c, s - lattice.half_count, q)
    return motion_along(lattice, first_q, speeds, problem.step_s)


def _start_costs(problem: Problem, lattice: Lattice, joints: FloatArray, turns: Turns, starts: BoolArray) -> FloatArray:
    """Return 0 for a possible start and infinity elsewhere: (n_turns, n_speeds, n_q)."""
    costs = np.full((len(turns.turns), *starts.shape), np.inf)
    fits = [fitting(turns, row) for row in joints]
    for s, q in np.argwhere(starts).tolist():
        i = s - lattice.half_count
        angle_deg = lattice.reference.angles_deg[0] + (2 * (q + lattice.first_q) + i) * lattice.node_deg
        if problem.map.is_allowed(0, float(angle_deg)):
            costs[fits[i & 1][:, q + (i >> 1) + reach(lattice)], s, q] = 0.0
    return costs


def _up_to(lattice: Lattice, column: int) -> Lattice:
    """Return the lattice that ends with a column: its last step is prepared on its own."""
    angles_deg, speeds_deg_s, accelerations_deg_s2 = lattice.reference
    end = column + 1
    return lattice._replace(reference=Motion(angles_deg[:end], speeds_deg_s[:end], accelerations_deg_s2[:column]))


def _first_bar(
    terms: Terms, lattice: Lattice, turns: Turns, joints: FloatArray, alive: list[BoolArray]
) -> Reason | None:
    """Return the limit that bars most moves of the last step.

    If only the table's limits bar them, use the previous step.
    """
    bars, rows = np.zeros(BARS, dtype=np.int64), make_rows(lattice)
    for k in range(len(alive) - 1, -1, -1):
        lay_out_step(terms, _up_to(lattice, k + 1), k, rows)
        _count_bars(terms, lattice, k, turns, joints[k], joints[k + 1], rows, alive[k], bars)
        if bars.any():
            break
    return Reason(int(Reason.JOINT_1_LIMIT) + int(np.argmax(bars))) if bars.any() else None


@kernel
def _advance(
    terms: Terms,
    lattice: Lattice,
    k: int,
    turns: Turns,
    runs: Runs,
    rows: StepRows,
    arrivals: FloatArray,
    now: FloatArray,
    later: FloatArray,
    choices: ChoiceArray,
) -> None:
    """Write the cost of the states of the next column, and the speed before each, from the states of column k."""
    half, barrier, leaving = lattice.half_count, np.empty(lattice.q_count), np.empty(lattice.q_count)
    later[:], choices[:] = np.inf, _NO_CHOICE
    for s in range(2 * half + 1):
        i = s - half
        first, last = steps_from(terms, lattice, k, i)
        if not now[:, s].min() < np.inf:
            continue
        for j in range(first, last + 1):
            if _write_barrier(terms, lattice, k, i, j, rows, barrier):
                for c in range(len(turns.turns)):
                    least = np.inf
                    for m in range(lattice.q_count):
                        leaving[m] = now[c, s, m] + barrier[m]
                        least = min(least, leaving[m])
                    if least < np.inf:
                        _move(lattice, c, i, j, turns, runs, arrivals, leaving, later, choices)


@kernel
def _write_barrier(terms: Terms, lattice: Lattice, k: int, i: int, j: int, rows: StepRows, barrier: FloatArray) -> bool:
    """Write per q the cost of the step from speed i to j without its arrival; return whether it is allowed anywhere."""
    reference, unit = lattice.reference, speed_unit(lattice, terms.step_s)
    speed, later = reference.speeds_deg_s[k] + i * unit, reference.speeds_deg_s[k + 1] + j * unit
    acceleration = reference.accelerations_deg_s2[k] + (j - i) * unit / terms.step_s
    cost = acceleration_cost(terms.acceleration_weight, acceleration) + speed_cost(terms.speed_weight, later)
    cost /= cost_unit(terms)
    start, parity = margin(lattice) + (i >> 1), i & 1
    above, below = rows.room_above[parity, start:], rows.room_below[parity, start:]
    turns_back = speed * later < 0.0
    upwards = later > 0.0 if turns_back else speed + later >= 0.0
    room, need = (above, i + j) if upwards else (below, -i - j)
    turn_room, turn = (rows.turn_below if upwards else rows.turn_above)[parity, start:], -np.inf
    if turns_back:
        way_deg = 0.5 * speed * speed * terms.step_s / (speed - later)
        turn = abs(way_deg) / lattice.node_deg - TURN_ROUNDING
    is_allowed = False
    for m in range(lattice.q_count):
        is_free = room[m] >= need and turn_room[m] >= turn
        barrier[m] = cost if is_free else np.inf
        is_allowed |= is_free
    return is_allowed


@kernel
def _move(
    lattice: Lattice,
    c: int,
    i: int,
    j: int,
    turns: Turns,
    runs: Runs,
    arrivals: FloatArray,
    leaving: FloatArray,
    later: FloatArray,
    choices: ChoiceArray,
) -> None:
    """Reduce the costs of the next column to those of one step, from speed i to j and from one combination of turns."""
    half, count = lattice.half_count, lattice.q_count
    start, ahead = reach(lattice) + (i >> 1), margin(lattice) + (j >> 1)
    number = 2 * (i + j + 2 * half) + (i & 1)
    for run in range(runs.begins[number], runs.begins[number + 1]):
        onward = turns.after[c, runs.change[run]]
        m, last = max(runs.first[run] - start, 0), min(runs.last[run] - start, count)
        if not lattice.is_closed:
            m, last = max(m, -i), min(last, count - i)
        while onward >= 0 and m < last:
            end = (m + i) % count
            length = min(last - m, count - end)
            _lower(
                leaving[m : m + length], arrivals[onward, j & 1, ahead + end :], i + half,
                later[onward, j + half, end:], choices[onward, j + half, end:],
            )  # fmt: skip
            m += length


@kernel
def _lower(leaving: FloatArray, arrival: FloatArray, choice: int, later: FloatArray, choices: ChoiceArray) -> None:
    """Reduce the costs of neighboring states of the next column if those of this column are lower."""
    for m in range(len(leaving)):
        total = leaving[m] + arrival[m]
        is_better = total < later[m]
        later[m] = total if is_better else later[m]
        choices[m] = choice if is_better else choices[m]


@kernel
def _count_bars(
    terms: Terms,
    lattice: Lattice,
    k: int,
    turns: Turns,
    before: FloatArray,
    after: FloatArray,
    rows: StepRows,
    alive: BoolArray,
    bars: IndexArray,
) -> None:
    """Count the table's moves in a step that each bar of the arm prevents, (BARS,): see `count_bar`."""
    half, ahead, barrier = lattice.half_count, reach(lattice), np.empty(lattice.q_count)
    for i in range(-half, half + 1):
        first, last = steps_from(terms, lattice, k, i)
        for j in range(first, last + 1):
            if not _write_barrier(terms, lattice, k, i, j, rows, barrier):
                continue
            for m in range(lattice.q_count):
                value_cost = rows.value_cost[j & 1, (m + i) % lattice.q_count + (j >> 1) + margin(lattice)]
                is_inside = lattice.is_closed or 0 <= m + i < lattice.q_count
                if is_inside and barrier[m] < np.inf and value_cost < ANY_COST:
                    start = before[i & 1, m + (i >> 1) + ahead]
                    end = after[j & 1, m + i + (j >> 1) + ahead]
                    for c in range(len(turns.turns)):
                        if alive[c, i + half, m]:
                            count_bar(turns, c, start, end, bars)


@kernel
def _backtrack(
    lattice: Lattice, turns: Turns, joints: FloatArray, choices: ChoiceArray, c: int, i: int, m: int
) -> tuple[int, IndexArray]:
    """Return the first q, and i at each column (n + 1,), of the best path to a state of the last column."""
    steps, half, ahead = len(choices), lattice.half_count, reach(lattice)
    speeds = np.empty(steps + 1, dtype=np.int64)
    speeds[steps] = i
    for k in range(steps, 0, -1):
        j, i = i, choices[k - 1, c, i + half, m] - half
        start = m - i
        if lattice.is_closed:
            start %= lattice.q_count
        before = joints[k - 1, i & 1, start + (i >> 1) + ahead]
        code = turn_change(turns, before, joints[k, j & 1, start + i + (j >> 1) + ahead])
        for earlier in range(len(turns.turns)):
            if turns.after[earlier, code] == c:
                c = earlier
                break
        m, speeds[k - 1] = start, i
    return m + lattice.first_q, speeds
