"""The receding horizon planner: plan again at each step, over the columns of the map in view.

For a path that becomes known during the scan. Each step solves the cost-to-go over the columns in view, on a coarser
grid than the default planner's. Then it executes the first step of the best motion. Columns beyond the view cost
nothing. If the columns in view cannot be crossed, the scan must pause. A pause costs more than any motion in view, so
the number of pauses is minimum. Each pause ends at the angle with the best continuation (Algorithm 1 uses the nearest
one).
"""

from typing import NamedTuple

import numpy as np

from planner.arrays import CostArray, FloatArray
from planner.defaults import RECEDING
from planner.errors import PlannerError
from planner.kernel import kernel
from planner.map.config_map import column_value
from planner.plans.crossing import RunArray, step_is_allowed
from planner.plans.plan import Outcome, Pause, greedy_start, make_plan, obvious_infeasibility
from planner.plans.problem import Problem, Terms
from planner.search.backward_step import BackwardStep, prepare_backward_step, step_back
from planner.search.cost_to_go import cost_from_any_speed, lay_out_columns
from planner.search.state_grid import Grid, default_grid
from planner.table.cost import acceleration_cost, speed_cost, value_cost
from planner.table.motion import next_angle, next_speed

# With 50 columns of 100 angles in view a step takes 0.4 ms; with the fast grid 0.15 ms, at a few percent more cost.
SPEED_COUNT = 31
FAST_SPEED_COUNT = 13

# Number of accelerations tried from the present state, over the whole range between the limits.
TRIALS = 41


class HorizonError(PlannerError):
    """A view without a column."""


class OnlineStep(NamedTuple):
    """Constants of all online steps.

    Attributes:
        grid: sampling points of the cost-to-go.
        unit: cost of one unit of it.
        backward: its backward step.
        layers: (2, n_speeds, n_angles) work arrays for the cost-to-go of two columns.
    """

    grid: Grid
    unit: float
    backward: BackwardStep
    layers: CostArray


def receding(problem: Problem, columns_in_view: int = 50, speed_count: int = SPEED_COUNT) -> Outcome:
    """Return the plan that results if only the next `columns_in_view` columns are known at each step.

    A free start is at rest at the angle with the maximum value of the first location.

    Args:
        problem: the problem.
        columns_in_view: number of columns that each step looks ahead; cut at the last column.
        speed_count: approximate number of speeds of the cost-to-go; the time of a step and its quality increase with
            it.
    """
    if columns_in_view < 1:
        raise HorizonError(f"the view is {columns_in_view} columns; allowed: 1 or more")
    no_plan = obvious_infeasibility(problem, RECEDING)
    if no_plan is not None:
        return no_plan
    angle_deg, speed_deg_s = greedy_start(problem)
    online = prepare_online_step(problem, speed_count)
    node_cost, sweep = lay_out_columns(problem.terms, online.grid, online.unit)
    angles, speeds, accelerations = _recede(
        problem.terms, online, node_cost, sweep, columns_in_view, angle_deg, speed_deg_s
    )
    paused = np.flatnonzero(np.isnan(accelerations))
    accelerations[paused] = 0.0
    pauses = [Pause(int(k), float(angles[k]), float(angles[k + 1])) for k in paused]
    return make_plan(problem, RECEDING, angles, speeds, accelerations, pauses)


def prepare_online_step(problem: Problem, speed_count: int = SPEED_COUNT, jump_count: int | None = None) -> OnlineStep:
    """Return the data for `online_step`, prepared once for a map's size, the limits and the weights.

    Args:
        problem: the map's size, limits and weights.
        speed_count: approximate number of speeds of the cost-to-go.
        jump_count: number of changes of speed in a step; None: the default for the number of speeds.
    """
    if jump_count is None:
        jump_count = 5 if speed_count <= FAST_SPEED_COUNT else 15
    grid = default_grid(problem, refinement=1, speed_count=speed_count, jump_count=jump_count, least_reach=2)
    unit = problem.greatest_step_cost
    backward = prepare_backward_step(problem.terms, grid, unit)
    layers = np.empty((2, len(backward.step_count), grid.angle_count), dtype=np.float32)
    return OnlineStep(grid, unit, backward, layers)


@kernel
def _recede(
    terms: Terms,
    online: OnlineStep,
    node_cost: CostArray,
    sweep: RunArray,
    columns_in_view: int,
    angle_deg: float,
    speed_deg_s: float,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    steps = len(sweep)
    angles, speeds, accelerations = np.empty(steps + 1), np.empty(steps + 1), np.empty(steps)
    angles[0], speeds[0] = angle_deg, speed_deg_s
    for k in range(steps):
        last = min(k + columns_in_view, steps)
        angles[k + 1], speeds[k + 1], accelerations[k] = online_step(
            terms, online, node_cost, sweep, k, last, angles[k], speeds[k]
        )
    return angles, speeds, accelerations


@kernel
def online_step(
    terms: Terms,
    online: OnlineStep,
    node_cost: CostArray,
    sweep: RunArray,
    column: int,
    last: int,
    angle_deg: float,
    speed_deg_s: float,
) -> tuple[float, float, float]:
    """Return the next angle and speed and the acceleration of the step; NaN for the latter if the scan pauses.

    Args:
        terms: the problem; its map beyond `last` is not read.
        online: from `prepare_online_step`; its work arrays are overwritten.
        node_cost: per column, from `lay_out_columns`.
        sweep: per step, from `lay_out_columns`.
        column: the present column.
        last: the last column in view.
        angle_deg: the present angle.
        speed_deg_s: the present speed.
    """
    look_ahead(online, node_cost, sweep, column, last)
    acceleration = _best_acceleration(terms, online, node_cost, column, last, angle_deg, speed_deg_s)
    if np.isnan(acceleration):
        return _best_angle_after_pause(online, node_cost, column, angle_deg), 0.0, np.nan
    return (
        next_angle(angle_deg, speed_deg_s, acceleration, terms.step_s),
        next_speed(speed_deg_s, acceleration, terms.step_s),
        acceleration,
    )


@kernel
def look_ahead(online: OnlineStep, node_cost: CostArray, sweep: RunArray, column: int, last: int) -> None:
    """Compute the cost-to-go of column + 1, over the columns up to `last`, into the layer of that column."""
    layers, pause_price = online.layers, float(last - column)
    layers[last % 2] = 0.0
    for k in range(last - 1, column, -1):
        later, earlier = layers[(k + 1) % 2], layers[k % 2]
        step_back(online.backward, later, node_cost[k + 1], sweep[k], pause_price, earlier)


@kernel
def _best_acceleration(
    terms: Terms, online: OnlineStep, node_cost: CostArray, column: int, last: int, angle_deg: float, speed_deg_s: float
) -> float:
    """Return the first acceleration of the best motion from a state; NaN if a pause is better or necessary."""
    after_pause = costs_at_rest(online, node_cost, column).min()
    best, least = np.nan, after_pause + (last - column) * online.unit
    for trial in range(TRIALS):
        acceleration = (2.0 * trial / (TRIALS - 1) - 1.0) * terms.acceleration_limit_deg_s2
        cost = trial_cost(terms, online, column, angle_deg, speed_deg_s, acceleration)
        if cost < least:
            best, least = acceleration, cost
    return best


@kernel
def _best_angle_after_pause(online: OnlineStep, node_cost: CostArray, column: int, angle_deg: float) -> float:
    """Return the angle of the next column with the minimum cost to continue, reached in the shorter direction."""
    target_deg = costs_at_rest(online, node_cost, column).argmin() * 360.0 / online.grid.angle_count
    return float(target_deg - 360.0 * np.round((target_deg - angle_deg) / 360.0))


@kernel
def costs_at_rest(online: OnlineStep, node_cost: CostArray, column: int) -> FloatArray:
    """Return, per angle, the cost of being at rest there in the next column and continuing."""
    costs: FloatArray = (node_cost[column + 1] + online.layers[(column + 1) % 2, online.grid.half_count]).astype(
        np.float64
    )
    return costs * online.unit


@kernel
def trial_cost(
    terms: Terms, online: OnlineStep, column: int, angle_deg: float, speed_deg_s: float, acceleration_deg_s2: float
) -> float:
    """Return the cost of one step and the continuation from its end; infinity if there is none."""
    speed = next_speed(speed_deg_s, acceleration_deg_s2, terms.step_s)
    if abs(speed) > terms.speed_limit_deg_s:
        return np.inf
    if not step_is_allowed(terms.runs, column, angle_deg, speed_deg_s, acceleration_deg_s2, terms.step_s):
        return np.inf
    angle = next_angle(angle_deg, speed_deg_s, acceleration_deg_s2, terms.step_s)
    to_go = cost_from_any_speed(online.layers, online.grid, (column + 1) % 2, speed, angle)
    return (
        acceleration_cost(terms.acceleration_weight, acceleration_deg_s2)
        + speed_cost(terms.speed_weight, speed)
        + value_cost(column_value(terms.values, terms.epsilon, column + 1, angle))
        + to_go * online.unit
    )
