"""The cost-to-go of a lattice, by backward dynamic programming (Bellman's equation).

The innermost loops are along q: contiguous, without branches, in single precision.
"""

import numpy as np

from planner.arrays import CostArray
from planner.kernel import kernel
from planner.plans.problem import Terms
from planner.search.lattice import (
    ANY_COST,
    UNREACHABLE,
    Lattice,
    StepRows,
    cost_unit,
    lay_out_step,
    make_rows,
    margin,
    rounded_up,
    speed_unit,
)
from planner.table.cost import acceleration_cost, speed_cost

# Rounding tolerances: added to a limit (relative), and subtracted from a reversal distance (in nodes).
ROUNDING = 1e-12
TURN_ROUNDING = 1e-10

ZERO = np.float32(0.0)
STEPS_AT_A_TIME = 3


@kernel
def cost_to_go(terms: Terms, lattice: Lattice) -> CostArray:
    """Return the minimum cost from every state to the last column: (n + 1, 2 half_count + 1, q_count).

    The unit is the maximum cost of a step. A constant per column is subtracted: its minimum is 0, which keeps single
    precision fine. UNREACHABLE if there is no path.
    """
    steps, speeds, count = len(terms.values) - 1, 2 * lattice.half_count + 1, lattice.q_count
    costs = np.zeros((steps + 1, speeds, count), dtype=np.float32)
    rows = make_rows(lattice)
    arrivals = np.empty((speeds, rows.value_cost.shape[1]), dtype=np.float32)
    step_costs, least = np.empty(2 * speeds - 1, dtype=np.float32), np.empty(count, dtype=np.float32)
    for k in range(steps - 1, -1, -1):
        lay_out_step(terms, lattice, k, rows)
        _lay_out_arrivals(terms, lattice, k + 1, rows, costs[k + 1], arrivals)
        _lay_out_step_costs(terms, lattice, k, step_costs)
        for s in range(speeds):
            costs[k, s] = UNREACHABLE
            _leave(terms, lattice, k, s - lattice.half_count, rows, arrivals, step_costs, costs[k, s])
        _subtract_least(costs[k], least)
    return costs


@kernel
def _subtract_least(costs: CostArray, least: CostArray) -> None:
    """Make the minimum of all costs 0, and costs above ANY_COST UNREACHABLE; `least` is a work array for one row."""
    least[:] = UNREACHABLE
    for s in range(len(costs)):
        for m in range(len(least)):
            least[m] = min(least[m], costs[s, m])
    subtracted = ANY_COST
    for m in range(len(least)):
        subtracted = min(subtracted, least[m])
    for s in range(len(costs)):
        for m in range(len(least)):
            costs[s, m] = costs[s, m] - subtracted if costs[s, m] < ANY_COST else UNREACHABLE


@kernel
def _lay_out_arrivals(
    terms: Terms, lattice: Lattice, column: int, rows: StepRows, onward: CostArray, arrivals: CostArray
) -> None:
    """Write the cost of arriving in a column, at each speed and q, and continuing from there."""
    start, count, half = margin(lattice), lattice.q_count, lattice.half_count
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
def _lay_out_step_costs(terms: Terms, lattice: Lattice, column: int, step_costs: CostArray) -> None:
    """Write the first term of Eq. (5) for steps that change the speed by -2 half_count .. 2 half_count, in units."""
    for a in range(len(step_costs)):
        added = (a - 2 * lattice.half_count) * speed_unit(lattice, terms.step_s) / terms.step_s
        acceleration = lattice.reference.accelerations_deg_s2[column] + added
        step_costs[a] = acceleration_cost(terms.acceleration_weight, acceleration) / cost_unit(terms)


@kernel
def steps_from(terms: Terms, lattice: Lattice, column: int, i: int) -> tuple[int, int]:
    """Return the first and the last speed j at the end of a step from speed i of a column; in reverse order if none."""
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
def _leave(
    terms: Terms,
    lattice: Lattice,
    column: int,
    i: int,
    rows: StepRows,
    arrivals: CostArray,
    step_costs: CostArray,
    best: CostArray,
) -> None:
    """Reduce `best`, per q, to the minimum cost of leaving speed i of a column."""
    unit, half, row_length = speed_unit(lattice, terms.step_s), lattice.half_count, arrivals.shape[1]
    speed, later = lattice.reference.speeds_deg_s[column] + i * unit, lattice.reference.speeds_deg_s[column + 1]
    first, last = steps_from(terms, lattice, column, i)
    parity, start = i & 1, margin(lattice) + (i >> 1)
    above, below = rows.room_above[parity, start:], rows.room_below[parity, start:]
    onward = arrivals.ravel()[margin(lattice) + i :]
    # The speeds up to `down` are below 0, those from `up` on above it.
    down, up = int(np.ceil(-later / unit)) - 1, int(np.floor(-later / unit)) + 1
    lowest_upwards = max(down + 1, first) if speed >= 0.0 else last + 1
    for j in range(lowest_upwards, last + 1, STEPS_AT_A_TIME):
        more, place, cost_place = min(last - j, STEPS_AT_A_TIME - 1), (j + half) * row_length, j - i + 2 * half
        _lower(best, onward, place, row_length, step_costs, cost_place, 1, more, above, np.float32(i + j))
    highest_downwards = min(up - 1 if speed < 0.0 else down, last) if speed <= 0.0 else first - 1
    for j in range(highest_downwards, first - 1, -STEPS_AT_A_TIME):
        more, place, cost_place = min(j - first, STEPS_AT_A_TIME - 1), (j + half) * row_length, j - i + 2 * half
        _lower(best, onward, place, -row_length, step_costs, cost_place, -1, more, below, np.float32(-i - j))
    lowest_turning, highest_turning = (first, min(down, last)) if speed > 0.0 else (max(up, first), last)
    room, turn_room, way = (
        (below, rows.turn_above[parity, start:], -1) if speed > 0.0 else (above, rows.turn_below[parity, start:], 1)
    )
    for j in range(lowest_turning, highest_turning + 1 if speed != 0.0 else lowest_turning):
        turn_deg = 0.5 * speed * speed * terms.step_s / abs(speed - later - j * unit)
        turn = rounded_up(turn_deg / lattice.node_deg - TURN_ROUNDING)
        cost = step_costs[j - i + 2 * half]
        _lower_turning(best, onward[(j + half) * row_length :], cost, room, np.float32(way * (i + j)), turn_room, turn)


@kernel
def _lower(
    best: CostArray,
    onward: CostArray,
    place: int,
    stride: int,
    step_costs: CostArray,
    cost_place: int,
    way: int,
    more: int,
    room: CostArray,
    need: np.float32,
) -> None:
    """Reduce `best` by up to three steps that all move in one direction: they share the overhead of the innermost loop.

    Args:
        best: per q.
        onward: cost of arriving and continuing, flattened.
        place: index of the end of the first step from q = first_q; the next ones are `stride` further.
        stride: distance to the next speed.
        step_costs: by change of speed.
        cost_place: index for the first step; the next one is one index up or down.
        way: 1 upward, -1 downward.
        more: further steps after the first, up to two.
        room: available nodes per q.
        need: nodes that the first step needs; each further one needs one node more.
    """
    b, c = min(1, more), min(2, more)
    row_a, row_b, row_c = onward[place:], onward[place + b * stride :], onward[place + c * stride :]
    cost_a, cost_b = step_costs[cost_place], step_costs[cost_place + b * way]
    cost_c = step_costs[cost_place + c * way]
    need_b, need_c = need + np.float32(b), need + np.float32(c)
    for m in range(len(best)):
        total_a = row_a[m] + cost_a + UNREACHABLE * max(need - room[m], ZERO)
        total_b = row_b[m] + cost_b + UNREACHABLE * max(need_b - room[m], ZERO)
        total_c = row_c[m] + cost_c + UNREACHABLE * max(need_c - room[m], ZERO)
        best[m] = min(min(min(best[m], total_a), total_b), total_c)  # noqa: PLW3301 - this form is vectorized


@kernel
def _lower_turning(
    best: CostArray,
    onward: CostArray,
    cost: np.float32,
    room: CostArray,
    need: np.float32,
    turn_room: CostArray,
    turn: np.float32,
) -> None:
    """Reduce `best` by a step that reverses within the step."""
    for m in range(len(best)):
        lacking = max(max(need - room[m], turn - turn_room[m]), ZERO)  # noqa: PLW3301 - this form is vectorized
        best[m] = min(best[m], onward[m] + cost + UNREACHABLE * lacking)
