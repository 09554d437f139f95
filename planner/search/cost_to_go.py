"""The minimum cost from every state (column, speed, angle) to the last column, by backward dynamic programming.

Following it forward gives a plan (`dynamic_programming.py`). Each column is computed from the next
(`backward_step.py`).
"""

from typing import NamedTuple

import numpy as np

from planner.arrays import CostArray
from planner.kernel import kernel
from planner.map.config_map import column_value, sample_at_or_above, sample_at_or_below
from planner.plans.crossing import RunArray, crossing_is_allowed
from planner.plans.problem import Problem, Terms
from planner.search.backward_step import (
    ANY_COST,
    NO_PAUSE,
    UNREACHABLE,
    BackwardStep,
    prepare_backward_step,
    step_back,
)
from planner.search.state_grid import Grid, GridError
from planner.table.cost import value_cost

# 0.8 GB.
MOST_STATES = 200_000_000


class CostToGo(NamedTuple):
    """The cost-to-go and its grid.

    Attributes:
        grid: its sampling points.
        costs: (n + 1, n_speeds, n_angles), in units of `unit`; above ANY_COST if the path cannot be crossed.
        unit: cost of one unit. It keeps all weights within single precision.
    """

    grid: Grid
    costs: CostArray
    unit: float


def cost_to_go(problem: Problem, grid: Grid) -> CostToGo:
    """Return the minimum cost from every state of the grid to the last column.

    The result dominates the memory: 4 bytes per state.

    Raises:
        GridError: the result would exceed MOST_STATES.
    """
    states = grid.state_count(problem.map.location_count)
    if states > MOST_STATES:
        raise GridError(
            f"the cost-to-go would have {states:,} states (locations x speeds x angles); allowed are {MOST_STATES:,}; "
            "reduce the number of locations or angles, or use limits with which full speed takes fewer steps"
        )
    unit = problem.greatest_step_cost
    backward = prepare_backward_step(problem.terms, grid, unit)
    node_cost, sweep = lay_out_columns(problem.terms, grid, unit)
    return CostToGo(grid, _solve(backward, node_cost, sweep), unit)


@kernel
def cost_from(costs: CostArray, grid: Grid, column: int, speed: int, angle_deg: float) -> float:
    """Return the interpolated cost-to-go at a speed of the grid and any angle; infinity if there is no continuation."""
    count = costs.shape[2]
    position = (angle_deg - grid.angle_origin_deg) * count / 360.0
    below, above = sample_at_or_below(position), sample_at_or_above(position)
    lower = float(costs[column, speed, below % count])
    upper = float(costs[column, speed, above % count])
    if lower > ANY_COST or upper > ANY_COST:
        return np.inf
    return lower + (position - below) * (upper - lower) if above > below else lower


@kernel
def cost_from_any_speed(costs: CostArray, grid: Grid, column: int, speed_deg_s: float, angle_deg: float) -> float:
    """Return the cost-to-go, interpolated between two speeds too; infinity if either has no continuation."""
    position = min(max(speed_deg_s / grid.speed_step_deg_s + grid.half_count, 0.0), costs.shape[1] - 1.0)
    below, above = sample_at_or_below(position), sample_at_or_above(position)
    lower = cost_from(costs, grid, column, below, angle_deg)
    if above <= below:
        return lower
    upper = cost_from(costs, grid, column, above, angle_deg)
    return lower + (position - below) * (upper - lower) if max(lower, upper) < np.inf else np.inf


@kernel
def lay_out_columns(terms: Terms, grid: Grid, unit: float) -> tuple[CostArray, RunArray]:
    """Return 1 - f_R at every node (unreachable if forbidden), and how far upward each step may move.

    Returns:
        The (n + 1, n_angles) costs in units, and the (n, n_angles) counts of cells that may be crossed from a node: 0
        if only the node itself is allowed, -1 if not even that.
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
def _solve(backward: BackwardStep, node_cost: CostArray, sweep: RunArray) -> CostArray:
    steps, angles = sweep.shape
    costs = np.empty((steps + 1, len(backward.step_count), angles), dtype=np.float32)
    costs[steps] = 0.0
    for k in range(steps - 1, -1, -1):
        step_back(backward, costs[k + 1], node_cost[k + 1], sweep[k], NO_PAUSE, costs[k])
    return costs
