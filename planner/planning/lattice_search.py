"""The best path through a lattice: backward dynamic programming (Bellman's equation), then the path forwards.

The innermost loop runs along q: contiguous, without branches, in single precision.
"""

import numpy as np

from planner.arrays import CostArray, FloatArray
from planner.kernel import kernel
from planner.map.config_map import column_value, wrapped
from planner.planning.crossing import step_is_allowed
from planner.planning.lattice import (
    ANY_COST,
    UNREACHABLE,
    Lattice,
    StepRows,
    cost_unit,
    lay_out_step,
    make_rows,
    margin,
    speed_unit,
)
from planner.planning.problem import Terms
from planner.table.cost import acceleration_cost, speed_cost, value_cost
from planner.table.motion import Motion

# What rounding may add to a limit.
ROUNDING = 1e-12
TURN_ROUNDING = 1e-10


@kernel
def cost_to_go(terms: Terms, lattice: Lattice) -> CostArray:
    """Return the least cost from every state to the last column: (n + 1, 2 half_count + 1, count).

    In units of the greatest cost of a step, less a constant of the column: the least of it is 0, which keeps single
    precision fine. UNREACHABLE where there is no way.
    """
    steps, speeds, count = len(terms.values) - 1, 2 * lattice.half_count + 1, lattice.count
    costs = np.zeros((steps + 1, speeds, count), dtype=np.float32)
    rows = make_rows(lattice)
    arrivals = np.empty((speeds, rows.value_cost.shape[1]), dtype=np.float32)
    for k in range(steps - 1, -1, -1):
        lay_out_step(terms, lattice, k, rows)
        _lay_out_arrivals(terms, lattice, k + 1, rows, costs[k + 1], arrivals)
        least = UNREACHABLE
        for s in range(speeds):
            costs[k, s] = UNREACHABLE
            _leave(terms, lattice, k, s - lattice.half_count, rows, arrivals, costs[k, s])
            least = min(least, costs[k, s].min())
        for s in range(speeds):
            row = costs[k, s]
            for m in range(count):
                row[m] = row[m] - least if row[m] < ANY_COST else UNREACHABLE
    return costs


@kernel
def _lay_out_arrivals(
    terms: Terms, lattice: Lattice, column: int, rows: StepRows, onward: CostArray, arrivals: CostArray
) -> None:
    """Write what it costs to arrive in a column, at each speed and q, and to go on from there."""
    start, count, half = margin(lattice), lattice.count, lattice.half_count
    for s in range(2 * half + 1):
        j = s - half
        speed = lattice.reference.speeds_deg_s[column] + j * speed_unit(lattice, terms.step_s)
        cost = np.float32(speed_cost(terms.speed_weight, speed) / cost_unit(terms))
        row, value_cost = arrivals[s], rows.value_cost[j & 1, start + (j >> 1) :]
        for m in range(count):
            row[start + m] = min(value_cost[m] + onward[s, m] + cost, UNREACHABLE)
        for m in range(start):
            row[start - 1 - m] = row[start - 1 - m + count] if lattice.is_closed else UNREACHABLE
            row[start + count + m] = row[start + m] if lattice.is_closed else UNREACHABLE


@kernel
def steps_from(terms: Terms, lattice: Lattice, column: int, i: int) -> tuple[int, int]:
    """Return the first and the last speed j that a step from speed i of a column may end with; none if in reverse."""
    unit = speed_unit(lattice, terms.step_s)
    now, later = lattice.reference.speeds_deg_s[column], lattice.reference.speeds_deg_s[column + 1]
    if abs(now + i * unit) > terms.speed_limit_deg_s * (1.0 + ROUNDING):
        return 1, 0
    gain = terms.acceleration_limit_deg_s2 * terms.step_s
    reference_gain = lattice.reference.accelerations_deg_s2[column] * terms.step_s
    limit = terms.speed_limit_deg_s
    lowest = max((-limit - later) / unit, i + (-gain - reference_gain) / unit)
    highest = min((limit - later) / unit, i + (gain - reference_gain) / unit)
    first, last = int(np.ceil(lowest - ROUNDING * (1 + abs(i)))), int(np.floor(highest + ROUNDING * (1 + abs(i))))
    return max(first, -lattice.half_count), min(last, lattice.half_count)


@kernel
def _turn(terms: Terms, lattice: Lattice, column: int, i: int, j: int) -> float:
    """Return how far beyond its start a step turns back, upwards if positive, in nodes; 0 where it does not turn."""
    unit = speed_unit(lattice, terms.step_s)
    speed = lattice.reference.speeds_deg_s[column] + i * unit
    later = lattice.reference.speeds_deg_s[column + 1] + j * unit
    if speed * later >= 0.0:
        return 0.0
    return 0.5 * speed * speed * terms.step_s / ((speed - later) * lattice.node_deg)


@kernel
def _leave(
    terms: Terms, lattice: Lattice, column: int, i: int, rows: StepRows, arrivals: CostArray, best: CostArray
) -> None:
    """Lower `best`, per q, to the least cost of leaving speed i of a column."""
    start, half = margin(lattice) + (i >> 1), lattice.half_count
    parity, unit = i & 1, speed_unit(lattice, terms.step_s)
    above, below = rows.room_above[parity, start:], rows.room_below[parity, start:]
    turn_above, turn_below = rows.turn_above[parity, start:], rows.turn_below[parity, start:]
    first, last = steps_from(terms, lattice, column, i)
    for j in range(first, last + 1):
        acceleration = lattice.reference.accelerations_deg_s2[column] + (j - i) * unit / terms.step_s
        cost = np.float32(acceleration_cost(terms.acceleration_weight, acceleration) / cost_unit(terms))
        onward = arrivals[j + half, margin(lattice) + i :]
        turn, moved = _turn(terms, lattice, column, i, j), np.float32(i + j)
        if turn > 0.0:
            _lower_turning(best, onward, cost, below, -moved, turn_above, turn - TURN_ROUNDING)
        elif turn < 0.0:
            _lower_turning(best, onward, cost, above, moved, turn_below, -turn - TURN_ROUNDING)
        elif lattice.reference.speeds_deg_s[column] + lattice.reference.speeds_deg_s[column + 1] + (i + j) * unit > 0.0:
            _lower(best, onward, cost, above, moved)
        else:
            _lower(best, onward, cost, below, -moved)


@kernel
def _lower(best: CostArray, onward: CostArray, cost: float, room: CostArray, needed: float) -> None:
    for m in range(len(best)):
        total = onward[m] + cost if room[m] >= needed else UNREACHABLE
        best[m] = min(best[m], total)


@kernel
def _lower_turning(
    best: CostArray,
    onward: CostArray,
    cost: float,
    room: CostArray,
    needed: float,
    turn_room: FloatArray,
    turn_needed: float,
) -> None:
    for m in range(len(best)):
        total = onward[m] + cost if room[m] >= needed and turn_room[m] >= turn_needed else UNREACHABLE
        best[m] = min(best[m], total)


@kernel
def follow(terms: Terms, lattice: Lattice, costs: CostArray, q: int, i: int) -> Motion:
    """Return the best motion from a state of column 0 that has a way on."""
    reference, unit = lattice.reference, speed_unit(lattice, terms.step_s)
    angles, speeds = reference.angles_deg.copy(), reference.speeds_deg_s.copy()
    accelerations = reference.accelerations_deg_s2.copy()
    angles[0] += (2 * q + i) * lattice.node_deg
    speeds[0] += i * unit
    for k in range(len(accelerations)):
        j = _best_step(terms, lattice, costs, k, q, i)
        q, jump, i = q + i, j - i, j
        angles[k + 1] += (2 * q + i) * lattice.node_deg
        speeds[k + 1] += i * unit
        accelerations[k] += jump * unit / terms.step_s
    return Motion(angles, speeds, accelerations)


@kernel
def _best_step(terms: Terms, lattice: Lattice, costs: CostArray, column: int, q: int, i: int) -> int:
    """Return the speed j at the end of the best step from a state."""
    reference, unit = lattice.reference, speed_unit(lattice, terms.step_s)
    angle = reference.angles_deg[column] + (2 * q + i) * lattice.node_deg
    speed = reference.speeds_deg_s[column] + i * unit
    place = q + i - lattice.first
    place = wrapped(place, lattice.count) if lattice.is_closed else place
    best, least = i, np.inf
    first, last = steps_from(terms, lattice, column, i)
    for j in range(first, last + 1):
        acceleration = reference.accelerations_deg_s2[column] + (j - i) * unit / terms.step_s
        if not 0 <= place < lattice.count or costs[column + 1, j + lattice.half_count, place] >= ANY_COST:
            continue
        if not step_is_allowed(terms.runs, column, angle, speed, acceleration, terms.step_s):
            continue
        later = reference.speeds_deg_s[column + 1] + j * unit
        end = reference.angles_deg[column + 1] + (2 * (q + i) + j) * lattice.node_deg
        cost = acceleration_cost(terms.acceleration_weight, acceleration) + speed_cost(terms.speed_weight, later)
        cost += value_cost(column_value(terms.values, terms.epsilon, column + 1, end))
        cost += costs[column + 1, j + lattice.half_count, place] * cost_unit(terms)
        if cost < least:
            best, least = j, cost
    return best
