"""Algorithm 2, "ray shooting": at each step, evaluate rays of constant acceleration and choose the cheapest."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from planner.arrays import FloatArray
from planner.defaults import GUIDED_RAY_SHOOTING, RAY_SHOOTING
from planner.errors import PlannerError
from planner.kernel import kernel
from planner.map.config_map import column_value
from planner.planning.rotate_when_blocked import nearest_allowed_angle
from planner.plans.crossing import step_is_allowed
from planner.plans.plan import Outcome, Pause, greedy_start, make_plan, obvious_infeasibility
from planner.plans.problem import Problem, Terms
from planner.search.cost_to_go import CostToGo, cost_from_any_speed, cost_to_go
from planner.search.state_grid import Grid, default_grid
from planner.table.cost import acceleration_cost, speed_cost, value_cost
from planner.table.motion import limited_acceleration, next_angle, next_speed


class Rays(NamedTuple):
    """n_a and p of the paper: the number of rays, and of columns that each looks ahead (cut at the last column)."""

    rays: int = 21
    horizon: int = 30


# The cost beyond the horizon is known in this variant. A ray is straight while the best motion is not, so it should be
# short.
GUIDED_RAYS = Rays(horizon=2)


class RayError(PlannerError):
    """An invalid set of rays."""


def ray_accelerations(count: int, acceleration_limit_deg_s2: float) -> FloatArray:
    """Return the paper's non-uniform set A_i = a_max sign(s) s^2, ordered from 0 outward.

    So of equal costs the smallest acceleration is chosen.

    Raises:
        RayError: the count is not odd, so that 0 would be missing, or below 3.
    """
    if count < 3 or count % 2 == 0:
        raise RayError(f"the number of rays is {count}; allowed: any odd number from 3 up")
    half = (count - 1) // 2
    positive = acceleration_limit_deg_s2 * (np.arange(1, half + 1) / half) ** 2
    return np.concatenate(([0.0], np.column_stack((positive, -positive)).ravel()))


def ray_shooting(problem: Problem, rays: Rays | None = None) -> Outcome:
    """Return the plan of Algorithm 2: real-time and suboptimal, with a pause where all rays failed.

    A free start is at rest at the angle with the maximum value of the first location.
    """
    return _shoot(problem, rays or Rays(), RAY_SHOOTING, no_cost_to_go)


def guided_ray_shooting(problem: Problem, rays: Rays | None = None) -> Outcome:
    """Return the plan of ray shooting with the cost-to-go at the ends of the rays.

    So the rays account for the path beyond their horizon.
    """
    return _shoot(
        problem, rays or GUIDED_RAYS, GUIDED_RAY_SHOOTING, lambda asked: cost_to_go(asked, default_grid(asked))
    )


def _shoot(problem: Problem, rays: Rays, name: str, terminal: Callable[[Problem], CostToGo]) -> Outcome:
    accelerations = ray_accelerations(rays.rays, problem.limits.acceleration_deg_s2)
    if rays.horizon < 1:
        raise RayError(f"the horizon is {rays.horizon} columns; allowed: 1 or more")
    no_plan = obvious_infeasibility(problem, name)
    if no_plan is not None:
        return no_plan
    to_go = terminal(problem)
    angle_deg, speed_deg_s = greedy_start(problem)
    angles, speeds, chosen, paused = _algorithm_2(
        problem.terms, accelerations, rays.horizon, to_go, angle_deg, speed_deg_s
    )
    pauses = [Pause(int(k), float(angles[k]), float(angles[k + 1])) for k in np.flatnonzero(paused)]
    return make_plan(problem, name, angles, speeds, chosen, pauses)


def no_cost_to_go(problem: Problem) -> CostToGo:
    """Return the empty cost-to-go of plain ray shooting."""
    grid = Grid(problem.map.angle_count, 0.0, problem.limits.speed_deg_s, 1, np.zeros(1, dtype=np.int64))
    return CostToGo(grid, np.empty((0, 3, problem.map.angle_count), dtype=np.float32), 1.0)


@kernel
def _algorithm_2(
    terms: Terms,
    accelerations: FloatArray,
    horizon: int,
    to_go: CostToGo,
    angle_deg: float,
    speed_deg_s: float,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    steps = len(terms.values) - 1
    angles, speeds = np.empty(steps + 1), np.empty(steps + 1)
    chosen, paused = np.zeros(steps), np.zeros(steps)
    angles[0], speeds[0] = angle_deg, speed_deg_s
    for k in range(steps):
        best = cheapest_ray(terms, accelerations, k, horizon, to_go, angles[k], speeds[k])
        a = limited_acceleration(speeds[k], accelerations[best], terms.step_s, terms.speed_limit_deg_s)
        if step_is_allowed(terms.runs, k, angles[k], speeds[k], a, terms.step_s):
            chosen[k] = a
            angles[k + 1] = next_angle(angles[k], speeds[k], a, terms.step_s)
            speeds[k + 1] = next_speed(speeds[k], a, terms.step_s)
        else:
            paused[k] = 1.0
            angles[k + 1] = nearest_allowed_angle(terms, k + 1, angles[k])
            speeds[k + 1] = 0.0
    return angles, speeds, chosen, paused


@kernel
def cheapest_ray(
    terms: Terms,
    accelerations: FloatArray,
    column: int,
    horizon: int,
    to_go: CostToGo,
    angle_deg: float,
    speed_deg_s: float,
) -> int:
    """Return the index of the cheapest ray from this state; the first of equal ones."""
    last = min(column + horizon, len(terms.values) - 1)
    best, least = 0, np.inf
    for i in range(len(accelerations)):
        cost = ray_cost(terms, accelerations[i], column, last, to_go, angle_deg, speed_deg_s, least)
        if cost < least:
            best, least = i, cost
    return best


@kernel
def ray_cost(
    terms: Terms,
    acceleration_deg_s2: float,
    column: int,
    last: int,
    to_go: CostToGo,
    angle_deg: float,
    speed_deg_s: float,
    bound: float,
) -> float:
    """Return the result of `evalpath`: the cost of a ray from column + 1 to `last`, including both.

    Once it leaves the allowed region, at a column or between two, each remaining step costs C_pen: the steps to `last`,
    or to the end of the map if a cost-to-go accounts for them. The speed saturates at its limit. No term is negative,
    so a ray whose cost has reached `bound` is not followed further.
    """
    cost = 0.0
    for k in range(column, last):
        a = limited_acceleration(speed_deg_s, acceleration_deg_s2, terms.step_s, terms.speed_limit_deg_s)
        if not step_is_allowed(terms.runs, k, angle_deg, speed_deg_s, a, terms.step_s):
            return cost + terms.pause_cost * (max(last, len(to_go.costs) - 1) - k)
        angle_deg = next_angle(angle_deg, speed_deg_s, a, terms.step_s)
        speed_deg_s = next_speed(speed_deg_s, a, terms.step_s)
        value = column_value(terms.values, terms.epsilon, k + 1, angle_deg)
        cost += acceleration_cost(terms.acceleration_weight, a)
        cost += speed_cost(terms.speed_weight, speed_deg_s)
        cost += value_cost(value)
        if cost >= bound:
            return cost
    if len(to_go.costs) == 0:
        return cost
    return cost + _terminal_cost(terms, to_go, last, angle_deg, speed_deg_s)


@kernel
def _terminal_cost(terms: Terms, to_go: CostToGo, column: int, angle_deg: float, speed_deg_s: float) -> float:
    """Return the cost-to-go; if there is no continuation, C_pen for each remaining column."""
    cost = to_go.unit * cost_from_any_speed(to_go.costs, to_go.grid, column, speed_deg_s, angle_deg)
    return min(cost, terms.pause_cost * (len(to_go.costs) - 1 - column))
