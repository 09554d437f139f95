"""Check any plan for correct shapes, and for Eq. (3) and (4) in each step."""

import numpy as np

from planner.plans.plan import Plan
from planner.plans.problem import Problem
from planner.table.motion import next_angle, next_speed

_ROUNDING = 1e-6


def contradiction(plan: Plan) -> str | None:
    """Return the first inconsistency of a plan with its own pauses and equations, or None.

    Args:
        plan: a plan of finite numbers, with one angle and one speed more than accelerations.
    """
    paused, waiting = {pause.step for pause in plan.pauses}, plan.waiting
    for step, from_deg, to_deg, _ in plan.pauses:
        if not 0 <= step < len(plan.accelerations_deg_s2) or (from_deg, to_deg, 0.0) != (
            plan.angles_deg[step], plan.angles_deg[step + 1], plan.speeds_deg_s[step + 1]
        ):  # fmt: skip
            return f"the pause in step {step} contradicts the angles"
    for location, duration_s in plan.waits:
        if not 0 <= location < len(plan.angles_deg) or not 0.0 < duration_s < np.inf:
            return f"the wait at location {location} is not one of a plan of {len(plan.angles_deg)} locations"
    for k, acceleration in enumerate(plan.accelerations_deg_s2):
        angle, speed = float(plan.angles_deg[k]), 0.0 if k in waiting else float(plan.speeds_deg_s[k])
        angle_error = plan.angles_deg[k + 1] - next_angle(angle, speed, float(acceleration), plan.step_s)
        speed_error = plan.speeds_deg_s[k + 1] - next_speed(speed, float(acceleration), plan.step_s)
        if k not in paused and max(abs(angle_error), abs(speed_error)) > _ROUNDING:
            return f"angle, speed and acceleration of step {k} contradict one another"
    return None


def plan_fault(problem: Problem, plan: Plan) -> str | None:
    """Return why a plan is not a result for a problem, or None; `verify` checks whether it can be executed."""
    n = problem.step_count
    arrays = (
        ("angles_deg", plan.angles_deg, n + 1),
        ("speeds_deg_s", plan.speeds_deg_s, n + 1),
        ("accelerations_deg_s2", plan.accelerations_deg_s2, n),
    )
    for name, array, count in arrays:
        if np.shape(array) != (count,):
            return f"{name} has shape {np.shape(array)}; it must be ({count},)"
        if not np.isfinite(np.asarray(array, dtype=np.float64)).all():
            return f"{name} holds a value that is not a finite number"
    if plan.step_s != problem.step_s:
        return f"step_s is {plan.step_s}; the problem's is {problem.step_s}"
    starts = (plan.angles_deg[0], problem.start_angle_deg), (plan.speeds_deg_s[0], problem.start_speed_deg_s)
    for name, (is_now, asked) in zip(("angle", "speed"), starts, strict=True):
        if asked is not None and abs(is_now - asked) > _ROUNDING:
            return f"the start {name} is {is_now:g}; the problem requires {asked:g}"
    return contradiction(plan)
