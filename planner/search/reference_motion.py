"""The motion at the center of a lattice: from the problem's start to rest on a sample of the map.

A gap of one sample can be passed only at rest on that sample. So the reference brings any start onto a sample, within
the limits but without regard to forbidden regions: the search around it avoids them.
"""

import numpy as np

from planner.map.config_map import SAMPLE_TOLERANCE
from planner.plans.problem import Problem
from planner.table.motion import Motion, roll_out

# Share of the acceleration limit that the reference uses: the rest is for the search.
ACCELERATION_SHARE = 0.5


def reference_motion(problem: Problem) -> Motion:
    """Return a motion with the problem's start that comes to rest on a sample and stays there.

    If the angle is free, it comes to rest at sample 0; if the speed is free, it rests from the start.
    """
    speed_deg_s = problem.start_speed_deg_s or 0.0
    start_deg = problem.start_angle_deg
    step_deg = problem.map.angle_step_deg
    if start_deg is None:
        steps = _step_count(problem, speed_deg_s, 0.0)
        return _brake(problem, -_braking_way(problem, speed_deg_s, steps), speed_deg_s, steps, 0.0)
    if speed_deg_s == 0.0 and abs(start_deg / step_deg - round(start_deg / step_deg)) <= SAMPLE_TOLERANCE:
        return _brake(problem, start_deg, 0.0, 0, start_deg)
    steps = _step_count(problem, speed_deg_s, 0.5 * step_deg)
    end_deg = step_deg * round((start_deg + _braking_way(problem, speed_deg_s, steps)) / step_deg)
    return _brake(problem, start_deg, speed_deg_s, steps, end_deg)


def _step_count(problem: Problem, speed_deg_s: float, aside_deg: float) -> int:
    """Return the number of steps to bring a start to rest anywhere within `aside_deg` of its stopping point."""
    limit = ACCELERATION_SHARE * problem.limits.acceleration_deg_s2
    if speed_deg_s == 0.0 and aside_deg == 0.0:
        return 0
    for steps in range(2, problem.step_count):
        duration_s = steps * problem.step_s
        needed = abs(speed_deg_s) / duration_s + 6.0 * aside_deg / (duration_s * (duration_s + problem.step_s))
        if needed <= limit:
            return steps
    return problem.step_count


def _braking_way(problem: Problem, speed_deg_s: float, steps: int) -> float:
    """Return the angle that the table moves when it brakes evenly."""
    return 0.5 * speed_deg_s * steps * problem.step_s


def _brake(problem: Problem, start_deg: float, speed_deg_s: float, steps: int, end_deg: float) -> Motion:
    """Return the motion that comes to rest at `end_deg` with the minimum sum of squared accelerations, and stays there.

    These accelerations are a linear function of time.
    """
    accelerations = np.zeros(problem.step_count)
    if steps > 0:
        accelerations[:steps] = -speed_deg_s / (steps * problem.step_s)
    if steps > 1:
        aside_deg = end_deg - start_deg - _braking_way(problem, speed_deg_s, steps)
        slope = 12.0 * aside_deg / (problem.step_s**2 * steps * (steps**2 - 1))
        accelerations[:steps] += slope * (0.5 * (steps - 1) - np.arange(steps))
    angles, speeds = roll_out(start_deg, speed_deg_s, accelerations, problem.step_s)
    if steps != 1:
        angles[steps:], speeds[steps:] = end_deg, 0.0
    return Motion(angles, speeds, accelerations)
