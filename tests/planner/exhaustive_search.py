"""The slow, obvious reference: every sequence of accelerations, in plain Python, with its own formulas."""

import itertools
import math
from collections.abc import Sequence

import numpy as np

from planner.map.config_map import ConfigurationMap
from planner.plans.plan import Plan
from planner.plans.problem import Problem

SUB_STEPS = 64


def motion(start: tuple[float, float], accelerations: Sequence[float], step_s: float) -> list[tuple[float, float]]:
    """Return (angle, speed) at each column, by the closed form of uniformly accelerated motion."""
    states = [start]
    for a in accelerations:
        angle, speed = states[-1]
        states.append((angle + speed * step_s + a * step_s**2 / 2, speed + a * step_s))
    return states


def is_forbidden_on_the_way(configuration_map: ConfigurationMap, plan: Plan) -> bool:
    """Return whether any of many sub-steps of any step outside pauses, or any column, is forbidden."""
    paused = {pause.step for pause in plan.pauses}
    for k, a in enumerate(plan.accelerations_deg_s2):
        for fraction in np.linspace(0.0, 1.0, SUB_STEPS + 1) if k not in paused else (1.0,):
            t = fraction * plan.step_s
            angle = plan.angles_deg[k] + plan.speeds_deg_s[k] * t + a * t * t / 2
            angle = plan.angles_deg[k + 1] if fraction == 1.0 else angle
            if not configuration_map.is_allowed(k + fraction, angle):
                return True
    return False


def cost_of(problem: Problem, states: Sequence[tuple[float, float]], accelerations: Sequence[float]) -> float:
    """Return Eq. (7); infinity for a motion that is forbidden anywhere or exceeds a limit."""
    total = 0.0
    for k, a in enumerate(accelerations):
        angle, speed = states[k]
        for i in range(SUB_STEPS + 1):
            t = problem.step_s * i / SUB_STEPS
            if not problem.map.is_allowed(k + i / SUB_STEPS, angle + speed * t + a * t * t / 2):
                return math.inf
        end_angle, end_speed = states[k + 1]
        if abs(end_speed) > problem.limits.speed_deg_s * (1 + 1e-9):
            return math.inf
        weights = problem.terms.acceleration_weight, problem.terms.speed_weight
        total += weights[0] * a**2 + weights[1] * end_speed**2 + 1.0 - problem.map.value(k + 1, end_angle)
    return total


def least_cost(problem: Problem, accelerations: Sequence[float]) -> float:
    """Return the cost of the best of all sequences of the given accelerations; infinity if none crosses."""
    start = (float(problem.start_angle_deg or 0.0), float(problem.start_speed_deg_s or 0.0))
    return min(
        cost_of(problem, motion(start, sequence, problem.step_s), sequence)
        for sequence in itertools.product(accelerations, repeat=problem.step_count)
    )
