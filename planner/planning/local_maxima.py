"""The "local maxima path" of the paper's comparison: at each location the angle with the maximum f_R."""

import numpy as np

from planner.defaults import LOCAL_MAXIMA
from planner.plans.plan import Outcome, greedy_start, make_plan, obvious_infeasibility
from planner.plans.problem import Problem
from planner.table.motion import motion_through_angles


def local_maxima(problem: Problem) -> Outcome:
    """Return the path through the angle with the maximum value of each location, in the shorter direction.

    It ignores limits and what is between two locations: a baseline, not a motion to execute. Its speeds and
    accelerations are the only ones with these angles under Eq. (3) and (4).
    """
    no_plan = obvious_infeasibility(problem, LOCAL_MAXIMA)
    if no_plan is not None:
        return no_plan
    start_deg, speed_deg_s = greedy_start(problem)
    brightest = problem.map.angles_deg[np.argmax(problem.map.values, axis=1)]
    angles = np.unwrap(np.concatenate(([start_deg], brightest[1:])), period=360.0)
    speeds, accelerations = motion_through_angles(angles, speed_deg_s, problem.step_s)
    return make_plan(problem, LOCAL_MAXIMA, angles, speeds, accelerations)
