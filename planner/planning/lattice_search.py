"""The best path through a lattice: backward dynamic programming (Bellman's equation), then the path forwards.

The innermost loop runs along q: contiguous, without branches, in single precision.
"""

import numpy as np

from planner.arrays import CostArray
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
    rounded_up,
    speed_unit,
)
from planner.planning.problem import Problem, Terms
from planner.table.cost import acceleration_cost, speed_cost, value_cost
from planner.table.motion import Motion

# What rounding may add to a limit.
ROUNDING = 1e-12
TURN_ROUNDING = 1e-10

ZERO = np.float32(0.0)


def best_motion(problem: Problem, lattice: Lattice) -> Motion | None:
    """Return the best motion of a lattice from the problem's start; None where it has none."""
    costs = cost_to_go(problem.terms, lattice)
    angle_is_free, speed_is_free = problem.start_angle_deg is None, problem.start_speed_deg_s is None
    q, i = _best_start(costs[0], lattice, angle_is_free, speed_is_free)
    if costs[0, i + lattice.half_count, (q - lattice.first_q) % lattice.q_count] >= ANY_COST:
        return None
    return follow(problem.terms, lattice, costs, q, i)


@kernel
def _best_start(costs: CostArray, lattice: Lattice, angle_is_free: bool, speed_is_free: bool) -> tuple[int, int]:
    """Return q and i of the best of the states that are a start: node 0 where the angle is given, speed 0 likewise."""
    best_q, best_i, least = 0, 0, UNREACHABLE
    for s in range(len(costs)):
        i = s - lattice.half_count
        if i != 0 and not speed_is_free:
            continue
        for place in range(lattice.q_count):
            q = place + lattice.first_q
            at_start = (2 * q + i) % (2 * lattice.q_count) == 0 if lattice.is_closed else 2 * q + i == 0
            if (angle_is_free or at_start) and costs[s, place] < least:
                best_q, best_i, least = q, i, costs[s, place]
    return best_q, best_i


@kernel
def cost_to_go(terms: Terms, lattice: Lattice) -> CostArray:
    """Return the least cost from every state to the last column: (n + 1, 2 half_count + 1, count).

    In units of the greatest cost of a step, less a constant of the column: the least of it is 0, which keeps single
    precision fine. UNREACHABLE where there is no way.
    """
    steps, speeds, count = len(terms.values) - 1, 2 * lattice.half_count + 1, lattice.q_count
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
def _leave(
    terms: Terms, lattice: Lattice, column: int, i: int, rows: StepRows, arrivals: CostArray, best: CostArray
) -> None:
    """Lower `best`, per q, to the least cost of leaving speed i of a column."""
    reference, unit = lattice.reference, speed_unit(lattice, terms.step_s)
    speed, later = reference.speeds_deg_s[column] + i * unit, reference.speeds_deg_s[column + 1]
    first, last = steps_from(terms, lattice, column, i)
    # Steps up to `down` end with a speed below 0, those from `up` on with one above it.
    down, up = int(np.ceil(-later / unit)) - 1, int(np.floor(-later / unit)) + 1
    if speed > 0.0:
        _lower_turning(terms, lattice, column, i, first, min(down, last), rows, arrivals, best)
        _lower(terms, lattice, column, i, max(down + 1, first), last, 1, rows, arrivals, best)
    elif speed < 0.0:
        _lower_turning(terms, lattice, column, i, max(up, first), last, rows, arrivals, best)
        _lower(terms, lattice, column, i, min(up - 1, last), first, -1, rows, arrivals, best)
    else:
        _lower(terms, lattice, column, i, min(down, last), first, -1, rows, arrivals, best)
        _lower(terms, lattice, column, i, max(down + 1, first), last, 1, rows, arrivals, best)


@kernel
def _lower(
    terms: Terms,
    lattice: Lattice,
    column: int,
    i: int,
    first: int,
    last: int,
    way: int,
    rows: StepRows,
    arrivals: CostArray,
    best: CostArray,
) -> None:
    """Lower `best` by the steps to the speeds from `first` to `last`, which move one way, 1 up or -1 down, throughout.

    Three steps at a time share what it costs to enter the innermost loop.
    """
    places = arrivals.shape[1]
    start = margin(lattice) + (i >> 1)
    room = rows.room_above[i & 1, start:] if way > 0 else rows.room_below[i & 1, start:]
    onward = arrivals.ravel()[margin(lattice) + i :]
    for a in range(first, last + way, 3 * way):
        b = a + way if way * (a + way) <= way * last else last
        c = b + way if way * (b + way) <= way * last else last
        cost_a, cost_b, cost_c = (
            _step_cost(terms, lattice, column, a - i),
            _step_cost(terms, lattice, column, b - i),
            _step_cost(terms, lattice, column, c - i),
        )
        need_a, need_b, need_c = np.float32(way * (i + a)), np.float32(way * (i + b)), np.float32(way * (i + c))
        row_a, row_b, row_c = (
            onward[(a + lattice.half_count) * places :],
            onward[(b + lattice.half_count) * places :],
            onward[(c + lattice.half_count) * places :],
        )
        for m in range(len(best)):
            total_a = row_a[m] + cost_a + UNREACHABLE * max(need_a - room[m], ZERO)
            total_b = row_b[m] + cost_b + UNREACHABLE * max(need_b - room[m], ZERO)
            total_c = row_c[m] + cost_c + UNREACHABLE * max(need_c - room[m], ZERO)
            best[m] = min(min(min(best[m], total_a), total_b), total_c)  # noqa: PLW3301 - this form is vectorised


@kernel
def _lower_turning(
    terms: Terms,
    lattice: Lattice,
    column: int,
    i: int,
    first: int,
    last: int,
    rows: StepRows,
    arrivals: CostArray,
    best: CostArray,
) -> None:
    """Lower `best` by steps to the speeds from `first` to `last`, which turn back on the way."""
    reference, unit = lattice.reference, speed_unit(lattice, terms.step_s)
    speed = reference.speeds_deg_s[column] + i * unit
    start, parity = margin(lattice) + (i >> 1), i & 1
    way = 1 if speed > 0.0 else -1
    room = rows.room_below[parity, start:] if way > 0 else rows.room_above[parity, start:]
    turn_room = rows.turn_above[parity, start:] if way > 0 else rows.turn_below[parity, start:]
    for j in range(first, last + 1):
        later = reference.speeds_deg_s[column + 1] + j * unit
        turn = rounded_up(
            abs(0.5 * speed * speed * terms.step_s / ((speed - later) * lattice.node_deg)) - TURN_ROUNDING
        )
        cost, need = _step_cost(terms, lattice, column, j - i), np.float32(-way * (i + j))
        onward = arrivals[j + lattice.half_count, margin(lattice) + i :]
        for m in range(len(best)):
            lacking = max(max(need - room[m], turn - turn_room[m]), ZERO)  # noqa: PLW3301 - this form is vectorised
            best[m] = min(best[m], onward[m] + cost + UNREACHABLE * lacking)


@kernel
def _step_cost(terms: Terms, lattice: Lattice, column: int, jump: int) -> np.float32:
    """Return the first term of Eq. (5) of a step that changes the speed by `jump` against the reference, in units."""
    added = jump * speed_unit(lattice, terms.step_s) / terms.step_s
    acceleration = lattice.reference.accelerations_deg_s2[column] + added
    return np.float32(acceleration_cost(terms.acceleration_weight, acceleration) / cost_unit(terms))


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
    place = q + i - lattice.first_q
    place = wrapped(place, lattice.q_count) if lattice.is_closed else place
    best, least = i, np.inf
    first, last = steps_from(terms, lattice, column, i)
    for j in range(first, last + 1):
        acceleration = reference.accelerations_deg_s2[column] + (j - i) * unit / terms.step_s
        if not 0 <= place < lattice.q_count or costs[column + 1, j + lattice.half_count, place] >= ANY_COST:
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
