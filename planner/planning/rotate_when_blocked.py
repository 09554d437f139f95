"""Algorithm 1, "rotate when out of range": stand still; if the next location is forbidden, pause and turn."""

import numpy as np

from planner.defaults import ROTATE_WHEN_BLOCKED
from planner.kernel import kernel
from planner.map.config_map import column_value, sample_at_or_above, sample_at_or_below
from planner.plans.plan import Outcome, Pause, greedy_start, make_plan, obvious_infeasibility
from planner.plans.problem import Problem, Terms


def rotate_when_blocked(problem: Problem) -> Outcome:
    """Return the plan of Algorithm 1. Every turn of the table pauses the scan; otherwise the table does not move.

    A free start is at rest at the angle with the maximum value of the first location; a start in motion pauses at once.
    """
    no_plan = obvious_infeasibility(problem, ROTATE_WHEN_BLOCKED)
    if no_plan is not None:
        return no_plan
    steps = problem.step_count
    angles, speeds = np.empty(steps + 1), np.zeros(steps + 1)
    angles[0], speeds[0] = greedy_start(problem)
    pauses = []
    for k in range(steps):
        angles[k + 1] = nearest_allowed_angle(problem.terms, k + 1, angles[k])
        if angles[k + 1] != angles[k] or speeds[k] != 0.0:
            pauses.append(Pause(k, float(angles[k]), float(angles[k + 1])))
    return make_plan(problem, ROTATE_WHEN_BLOCKED, angles, speeds, np.zeros(steps), pauses)


@kernel
def nearest_allowed_angle(terms: Terms, location: int, angle_deg: float) -> float:
    """Return the allowed angle of a location that is nearest to an angle, within half a turn in each direction.

    The paper steps away from the angle by the map's own step. Here the steps fall on the map's samples, so that any
    existing allowed angle is found. As in the paper, upward is tried first.

    Returns:
        The (unwrapped) angle; NaN if the whole location is forbidden.
    """
    if column_value(terms.values, terms.epsilon, location, angle_deg) > terms.epsilon:
        return angle_deg
    count: int = terms.values.shape[1]
    step_deg = 360.0 / count
    above, below = sample_at_or_above(angle_deg / step_deg), sample_at_or_below(angle_deg / step_deg)
    for _ in range(count):
        if above * step_deg - angle_deg <= angle_deg - below * step_deg + 1e-9:
            if terms.values[location, above % count] > terms.epsilon:
                return float(above * step_deg)
            above += 1
        else:
            if terms.values[location, below % count] > terms.epsilon:
                return float(below * step_deg)
            below -= 1
    return np.nan
