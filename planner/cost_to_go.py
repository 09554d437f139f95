"""The least cost from every state (column, speed, angle) to the last column, by backward dynamic programming.

Speeds lie on a grid and each step joins two of its speeds. The acceleration, and by how much the angle moves in the
step, then depend on these two speeds alone; and only the angle, one-dimensional and periodic, is interpolated. A value
is interpolated from two finite ones or it is infinite, so no cost leaks across the border of what can be crossed.

The innermost loop runs along the angle axis: contiguous, without branches or index arithmetic, in single precision.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from planner.arrays import IndexArray
from planner.config_map import SAMPLE_TOLERANCE, column_value, sample_at_or_above, sample_at_or_below
from planner.cost import acceleration_cost, speed_cost, value_cost
from planner.crossing import RunArray, crossing_is_allowed
from planner.kernel import kernel
from planner.motion import swept_angles
from planner.problem import Problem, Terms
from planner.state_grid import Grid, GridError

CostArray = npt.NDArray[np.float32]

# Infinity that survives a weight of 0, in single precision; what comes out of an interpolation with it is far above
# ANY_COST, which in turn is far above what a path can cost in units of the greatest step cost.
UNREACHABLE = np.float32(1e30)
ANY_COST = np.float32(1e12)
NO_PAUSE = float(UNREACHABLE)
ONE = np.float32(1.0)

# 0.8 GB.
MOST_STATES = 200_000_000

# A multiple of the vector length keeps the inner loop free of a scalar tail.
LANES = 8
JUMPS_AT_A_TIME = 3


class CostToGo(NamedTuple):
    """The cost-to-go and its grid.

    Attributes:
        grid: where it is sampled.
        costs: (n + 1, n_speeds, n_angles), in units of `unit`; above ANY_COST where the path cannot be crossed.
        unit: cost of one unit. It keeps any weights within single precision.
    """

    grid: Grid
    costs: CostArray
    unit: float


class Workspace(NamedTuple):
    """Room for one backward step: arrivals per speed and barriers per sweep, periodically continued; the best costs."""

    arrivals: CostArray
    barriers: CostArray
    best: CostArray


class Transitions(NamedTuple):
    """What a step between two speeds does to the angle, per (speed, jump), in samples of the grid's angle axis."""

    target: IndexArray  # speed index at the end of the step; n_speeds, where all is unreachable: off the grid
    shift: IndexArray  # whole samples that the angle moves, wrapped to one turn
    fraction: CostArray  # and the rest, 0 .. 1
    sweep_start: IndexArray  # sample at or below the lowest angle met on the way, wrapped
    sweep_length: IndexArray  # cells swept from there, at most one turn
    cost: CostArray  # first term of Eq. (5)


def cost_to_go(problem: Problem, grid: Grid) -> CostToGo:
    """Return the least cost from every state of the grid to the last column.

    Memory is dominated by the result: 4 bytes a state.

    Raises:
        GridError: that would be more than MOST_STATES.
    """
    states = grid.state_count(problem.map.location_count)
    if states > MOST_STATES:
        raise GridError(
            f"the cost-to-go would have {states:,} states (locations x speeds x angles); allowed are {MOST_STATES:,}: "
            "take fewer locations or angles, or limits that let the table reach its speed in fewer steps"
        )
    unit = problem.greatest_step_cost
    transitions = lay_out_transitions(problem.terms, grid, unit)
    columns = lay_out_columns(problem.terms, grid, unit)
    arrival = arrival_costs(problem.terms, grid, unit)
    costs = _solve(*columns, transitions, arrival)
    return CostToGo(grid, costs, unit)


def arrival_costs(terms: Terms, grid: Grid, unit: float) -> CostArray:
    """Return the second term of Eq. (5) for each speed of the grid."""
    return (speed_cost(terms.speed_weight, 1.0) / unit * grid.speeds_deg_s**2).astype(np.float32)


@kernel
def cost_from(costs: CostArray, grid: Grid, column: int, speed: int, angle_deg: float) -> float:
    """Return the cost-to-go at a speed of the grid and any angle, interpolated; infinite where there is no way on."""
    count = costs.shape[2]
    position = (angle_deg - grid.angle_origin_deg) * count / 360.0
    below, above = sample_at_or_below(position), sample_at_or_above(position)
    lower, upper = float(costs[column, speed, below % count]), float(costs[column, speed, above % count])
    if lower > ANY_COST or upper > ANY_COST:
        return np.inf
    return lower + (position - below) * (upper - lower) if above > below else lower


@kernel
def cost_from_any_speed(costs: CostArray, grid: Grid, column: int, speed_deg_s: float, angle_deg: float) -> float:
    """Return the cost-to-go, interpolated between two speeds of the grid too; infinite where either has no way on."""
    position = min(max(speed_deg_s / grid.speed_step_deg_s + grid.half_count, 0.0), costs.shape[1] - 1.0)
    below, above = sample_at_or_below(position), sample_at_or_above(position)
    lower = cost_from(costs, grid, column, below, angle_deg)
    if above <= below:
        return lower
    upper = cost_from(costs, grid, column, above, angle_deg)
    return lower + (position - below) * (upper - lower) if max(lower, upper) < np.inf else np.inf


@kernel
def lay_out_transitions(terms: Terms, grid: Grid, unit: float) -> Transitions:
    """Return what each step of the grid does; steps that leave it go to a row where all is unreachable."""
    angle_count, _, speed_step_deg_s, half_count, jumps = grid
    speeds = 2 * half_count + 1
    shape = (speeds, (len(jumps) + JUMPS_AT_A_TIME - 1) // JUMPS_AT_A_TIME * JUMPS_AT_A_TIME)
    target, shift, start, length = (
        np.full(shape, speeds, dtype=np.int64),
        np.zeros(shape, dtype=np.int64),
        np.zeros(shape, dtype=np.int64),
        np.zeros(shape, dtype=np.int64),
    )
    fraction, cost = np.zeros(shape, dtype=np.float32), np.zeros(shape, dtype=np.float32)
    samples_per_deg = angle_count / 360.0
    for i in range(speeds):
        for a in range(len(jumps)):
            j = i + jumps[a]
            if not 0 <= j < speeds:
                continue
            speed = (i - half_count) * speed_step_deg_s
            acceleration = jumps[a] * speed_step_deg_s / terms.step_s
            lowest, highest = swept_angles(0.0, speed, acceleration, terms.step_s)
            moved = 0.5 * (i + j - 2 * half_count) * speed_step_deg_s * terms.step_s * samples_per_deg
            whole = np.floor(moved + SAMPLE_TOLERANCE)
            first = np.floor(lowest * samples_per_deg + SAMPLE_TOLERANCE)
            last = np.ceil(highest * samples_per_deg - SAMPLE_TOLERANCE)
            target[i, a] = j
            shift[i, a] = int(whole) % angle_count
            fraction[i, a] = moved - whole if moved - whole > SAMPLE_TOLERANCE else 0.0
            start[i, a] = int(first) % angle_count
            length[i, a] = min(int(last - first), angle_count)
            cost[i, a] = acceleration_cost(terms.acceleration_weight, acceleration) / unit
    return Transitions(target, shift, fraction, start, length, cost)


@kernel
def lay_out_columns(terms: Terms, grid: Grid, unit: float) -> tuple[CostArray, RunArray]:
    """Return 1 - f_R at every node (unreachable where forbidden), and how far one may sweep upwards in each step.

    Returns:
        The (n + 1, n_angles) costs in units, and the (n, n_angles) counts of cells that may be swept from a node: 0
        where only the node itself is allowed, -1 where not even that.
    """
    steps, angle_count = len(terms.values) - 1, grid.angle_count
    step_deg = 360.0 / angle_count
    node_cost = np.empty((steps + 1, angle_count), dtype=np.float32)
    sweep = np.empty((steps, angle_count), dtype=np.int32)
    for k in range(steps + 1):
        for m in range(angle_count):
            value = column_value(terms.values, terms.epsilon, k, grid.angle_origin_deg + m * step_deg)
            node_cost[k, m] = value_cost(value) / unit if value > terms.epsilon else UNREACHABLE
    for k in range(steps):
        run = 0
        for m in range(2 * angle_count - 1, -1, -1):
            angle = grid.angle_origin_deg + m * step_deg
            run = run + 1 if crossing_is_allowed(terms.runs, k, angle, angle + step_deg) else 0
            if m < angle_count:
                is_open = run > 0 or crossing_is_allowed(terms.runs, k, angle, angle)
                sweep[k, m] = min(run, angle_count) if is_open else -1
    return node_cost, sweep


@kernel
def _solve(node_cost: CostArray, sweep: RunArray, transitions: Transitions, arrival_cost: CostArray) -> CostArray:
    steps, angles = sweep.shape
    costs = np.empty((steps + 1, len(arrival_cost), angles), dtype=np.float32)
    costs[steps] = 0.0
    workspace = make_workspace(angles, transitions)
    for k in range(steps - 1, -1, -1):
        step_back(costs[k + 1], node_cost[k + 1], sweep[k], transitions, arrival_cost, NO_PAUSE, workspace, costs[k])
    return costs


@kernel
def make_workspace(angle_count: int, transitions: Transitions) -> Workspace:
    """Return the arrays that `step_back` uses inside."""
    width = (angle_count + LANES - 1) // LANES * LANES
    arrivals = np.full((len(transitions.target) + 1, width + angle_count + 1), UNREACHABLE)
    barriers = np.empty((transitions.sweep_length.max() + 1, width + angle_count + 1), dtype=np.float32)
    return Workspace(arrivals, barriers, np.empty(width, dtype=np.float32))


@kernel
def step_back(
    later: CostArray,
    node_cost: CostArray,
    sweep: RunArray,
    transitions: Transitions,
    arrival_cost: CostArray,
    pause_price: float,
    workspace: Workspace,
    earlier: CostArray,
) -> None:
    """Write the cost-to-go of a column, given that of the next.

    Args:
        later: (n_speeds, n_angles) cost-to-go of the next column.
        node_cost: (n_angles,) 1 - f_R there, in units.
        sweep: (n_angles,) how many cells one may sweep upwards from each angle in between.
        transitions: what the steps do.
        arrival_cost: (n_speeds,) second term of Eq. (5).
        pause_price: units of cost for stopping the scan and going on at rest at any angle; NO_PAUSE rules that out.
        workspace: is overwritten.
        earlier: (n_speeds, n_angles) receives the result.
    """
    arrivals, barriers, best = workspace
    _lay_out_arrivals(later, node_cost, arrival_cost, arrivals)
    _lay_out_barriers(sweep, barriers)
    at_rest = arrivals[len(arrival_cost) // 2, : len(node_cost)]
    after_pause = np.float32(at_rest.min() + pause_price)
    for speed in range(len(arrival_cost)):
        _leave(speed, arrivals, barriers, transitions, best)
        for m in range(len(sweep)):
            cost = min(best[m], after_pause)
            earlier[speed, m] = cost if cost < ANY_COST else UNREACHABLE


@kernel
def _lay_out_arrivals(later: CostArray, node_cost: CostArray, arrival_cost: CostArray, arrivals: CostArray) -> None:
    """Write, periodically continued, what it costs to arrive in the next column and to go on from there."""
    angles = len(node_cost)
    for j in range(len(arrival_cost)):
        row, onward, cost = arrivals[j], later[j], arrival_cost[j]
        for m in range(angles):
            row[m] = min(node_cost[m] + cost + onward[m], UNREACHABLE)
        _continue_periodically(row, angles)


@kernel
def _lay_out_barriers(sweep: RunArray, barriers: CostArray) -> None:
    """Write, per length of the sweep and its first sample, 0 where it is allowed and infinity where it is not."""
    for length in range(len(barriers)):
        row = barriers[length]
        for m in range(len(sweep)):
            row[m] = 0.0 if sweep[m] >= length else UNREACHABLE
        _continue_periodically(row, len(sweep))


@kernel
def _continue_periodically(row: CostArray, period: int) -> None:
    done = period
    while done < len(row):
        count = min(period, len(row) - done)
        for m in range(count):
            row[done + m] = row[m]
        done += count


@kernel
def _leave(speed: int, arrivals: CostArray, barriers: CostArray, transitions: Transitions, best: CostArray) -> None:
    """Write the least cost of leaving a speed, by any of its jumps, for each angle.

    Three jumps at a time share what it costs to enter the innermost loop.
    """
    target, cost, fraction = transitions.target, transitions.cost, transitions.fraction
    shift, start, length = transitions.shift, transitions.sweep_start, transitions.sweep_length
    width = len(best)
    best[:] = UNREACHABLE
    for a in range(0, target.shape[1], JUMPS_AT_A_TIME):
        b, c = a + 1, a + 2
        row_a = arrivals[target[speed, a]][shift[speed, a] : shift[speed, a] + width + 1]
        row_b = arrivals[target[speed, b]][shift[speed, b] : shift[speed, b] + width + 1]
        row_c = arrivals[target[speed, c]][shift[speed, c] : shift[speed, c] + width + 1]
        barrier_a = barriers[length[speed, a]][start[speed, a] : start[speed, a] + width]
        barrier_b = barriers[length[speed, b]][start[speed, b] : start[speed, b] + width]
        barrier_c = barriers[length[speed, c]][start[speed, c] : start[speed, c] + width]
        cost_a, cost_b, cost_c = cost[speed, a], cost[speed, b], cost[speed, c]
        upper_a, upper_b, upper_c = fraction[speed, a], fraction[speed, b], fraction[speed, c]
        lower_a, lower_b, lower_c = ONE - upper_a, ONE - upper_b, ONE - upper_c
        for m in range(width):
            total_a = cost_a + barrier_a[m] + lower_a * row_a[m] + upper_a * row_a[m + 1]
            total_b = cost_b + barrier_b[m] + lower_b * row_b[m] + upper_b * row_b[m + 1]
            total_c = cost_c + barrier_c[m] + lower_c * row_c[m] + upper_c * row_c[m + 1]
            best[m] = min(min(min(best[m], total_a), total_b), total_c)  # noqa: PLW3301 - this form is vectorised
