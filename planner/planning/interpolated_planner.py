"""A plan from the interpolated cost-to-go: follow it forward with exact kinematics.

The cost-to-go (`cost_to_go.py`) exists only for states of its grid. The plan is computed forward from it: at each
column every reachable speed of the grid is tried, with Eq. (3) and (4), the exact check of the motion between the
columns and the exact cost, and the cheapest continuation is used. If the interpolated cost-to-go contains a
continuation that the exact motion does not have, the computation steps back and uses the next best.
"""

import numpy as np

from planner.arrays import FloatArray
from planner.kernel import kernel
from planner.map.config_map import column_value
from planner.plans.crossing import step_is_allowed
from planner.plans.plan import Plan, make_plan
from planner.plans.problem import Problem, Terms
from planner.search.cost_to_go import CostToGo, cost_from, cost_to_go
from planner.search.state_grid import Grid, default_grid
from planner.table.cost import acceleration_cost, speed_cost, value_cost
from planner.table.motion import next_angle, next_speed, roll_out

NAME = "interpolated"

# Maximum number of steps back, per column.
STEPS_BACK_PER_COLUMN = 50

# A free start is searched at this many angles per sample of the map.
STARTS_PER_SAMPLE = 4


def interpolated_plan(problem: Problem, grid: Grid | None = None) -> Plan | None:
    """Return a plan of nearly minimum cost; None if the interpolation finds none, which proves nothing."""
    return follow(problem, cost_to_go(problem, default_grid(problem) if grid is None else grid))


def follow(problem: Problem, to_go: CostToGo) -> Plan | None:
    """Compute the best motion along a cost-to-go; None if it finds no path across."""
    for angle_deg, speed_deg_s in _starts(problem, to_go):
        accelerations = _follow(problem.terms, to_go, angle_deg, speed_deg_s)
        if len(accelerations) == problem.step_count:
            angles, speeds = roll_out(angle_deg, speed_deg_s, accelerations, problem.step_s)
            return make_plan(problem, NAME, angles, speeds, accelerations)
    return None


def _starts(problem: Problem, to_go: CostToGo, count: int = 3) -> list[tuple[float, float]]:
    """Return the start, or the `count` most promising ones if it is free."""
    if problem.start_angle_deg is None:
        angles = np.linspace(0.0, 360.0, problem.map.angle_count * STARTS_PER_SAMPLE, endpoint=False)
    else:
        angles = np.array([problem.start_angle_deg], dtype=np.float64)
    free_speed = problem.start_speed_deg_s is None
    speeds = to_go.grid.speeds_deg_s if free_speed else np.array([problem.start_speed_deg_s], dtype=np.float64)
    costs = _start_costs(problem.terms, to_go, angles, speeds)
    order = np.argsort(costs, axis=None, kind="stable")[:count]
    rows, columns = np.unravel_index(order, costs.shape)
    return [
        (float(angles[i]), float(speeds[j])) for i, j in zip(rows, columns, strict=True) if np.isfinite(costs[i, j])
    ]


@kernel
def _start_costs(terms: Terms, to_go: CostToGo, angles_deg: FloatArray, speeds_deg_s: FloatArray) -> FloatArray:
    result = np.full((len(angles_deg), len(speeds_deg_s)), np.inf)
    for i in range(len(angles_deg)):
        if column_value(terms.values, terms.epsilon, 0, angles_deg[i]) > terms.epsilon:
            for j in range(len(speeds_deg_s)):
                continuations = continuation_costs(terms, to_go, 0, angles_deg[i], speeds_deg_s[j])
                result[i, j] = continuations.min()
    return result


@kernel
def continuation_costs(terms: Terms, to_go: CostToGo, column: int, angle_deg: float, speed_deg_s: float) -> FloatArray:
    """Return, per speed of the grid, the cost of reaching it in the next column and continuing to the last.

    Infinity if the acceleration exceeds its limit, the motion is forbidden or there is no continuation.
    """
    grid, costs = to_go.grid, to_go.costs
    result = np.full(costs.shape[1], np.inf)
    gain = terms.acceleration_limit_deg_s2 * terms.step_s / grid.speed_step_deg_s
    now = speed_deg_s / grid.speed_step_deg_s + grid.half_count
    first = max(0, int(np.ceil(now - gain - 1e-9)))
    last = min(costs.shape[1] - 1, int(np.floor(now + gain + 1e-9)))
    for j in range(first, last + 1):
        acceleration = acceleration_to(terms, grid, speed_deg_s, j)
        angle = next_angle(angle_deg, speed_deg_s, acceleration, terms.step_s)
        onward = cost_from(costs, grid, column + 1, j, angle)
        if onward < np.inf and step_is_allowed(terms.runs, column, angle_deg, speed_deg_s, acceleration, terms.step_s):
            value = column_value(terms.values, terms.epsilon, column + 1, angle)
            result[j] = (
                acceleration_cost(terms.acceleration_weight, acceleration)
                + speed_cost(terms.speed_weight, next_speed(speed_deg_s, acceleration, terms.step_s))
                + value_cost(value)
                + onward * to_go.unit
            )
    return result


@kernel
def acceleration_to(terms: Terms, grid: Grid, speed_deg_s: float, target: int) -> float:
    """Return the acceleration that leads to a speed of the grid in one step, clamped to the limit."""
    acceleration = ((target - grid.half_count) * grid.speed_step_deg_s - speed_deg_s) / terms.step_s
    limit = terms.acceleration_limit_deg_s2
    return max(-limit, min(limit, acceleration))


@kernel
def _follow(terms: Terms, to_go: CostToGo, angle_deg: float, speed_deg_s: float) -> FloatArray:
    """Return the (n,) accelerations of the best motion from a start; fewer if it finds no path across."""
    steps = len(to_go.costs) - 1
    angles, speeds, accelerations = np.empty(steps + 1), np.empty(steps + 1), np.empty(steps)
    angles[0], speeds[0] = angle_deg, speed_deg_s
    rank = np.zeros(steps + 1, dtype=np.int64)
    steps_back = STEPS_BACK_PER_COLUMN * steps
    k = 0
    while 0 <= k < steps and steps_back >= 0:
        continuations = continuation_costs(terms, to_go, k, angles[k], speeds[k])
        target = _of_rank(continuations, rank[k])
        if target < 0:
            steps_back -= 1
            k -= 1
            if k >= 0:
                rank[k] += 1
            continue
        accelerations[k] = acceleration_to(terms, to_go.grid, speeds[k], target)
        angles[k + 1] = next_angle(angles[k], speeds[k], accelerations[k], terms.step_s)
        speeds[k + 1] = next_speed(speeds[k], accelerations[k], terms.step_s)
        k += 1
        rank[k] = 0
    return accelerations if k == steps else accelerations[:0]


@kernel
def _of_rank(costs: FloatArray, rank: int) -> int:
    """Return the index of the `rank`-th smallest finite cost, -1 where there are fewer."""
    if rank == 0:
        best = int(costs.argmin())
    elif rank < len(costs):
        best = int(np.argsort(costs)[rank])
    else:
        return -1
    return best if costs[best] < np.inf else -1
