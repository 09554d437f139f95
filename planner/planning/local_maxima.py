"""The "local maxima path" that the paper compares with: at each location the angle with the greatest f_R."""

import numpy as np

from planner.defaults import LOCAL_MAXIMA
from planner.planning.plan import Outcome, greedy_start, make_plan, obvious_infeasibility
from planner.planning.problem import Problem
from planner.table.motion import motion_through_angles


def local_maxima(problem: Problem) -> Outcome:
    """Return the path through the brightest angle of each location, by the shorter way round.

    It minds neither limits nor what lies between two locations: a baseline, not a motion to execute. Its speeds and
    accelerations are the only ones that meet these angles under Eq. (3) and (4).
    """
    no_plan = obvious_infeasibility(problem, LOCAL_MAXIMA)
    if no_plan is not None:
        return no_plan
    start_deg, speed_deg_s = greedy_start(problem)
    brightest = problem.map.angles_deg[np.argmax(problem.map.values, axis=1)]
    angles = np.unwrap(np.concatenate(([start_deg], brightest[1:])), period=360.0)
    speeds, accelerations = motion_through_angles(angles, speed_deg_s, problem.step_s)
    return make_plan(problem, LOCAL_MAXIMA, angles, speeds, accelerations)
