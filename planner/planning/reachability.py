"""Can the path be crossed at all? One cost-to-go answers for every start angle and speed at once."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from planner.arrays import BoolArray, FloatArray
from planner.planning.backward_step import ANY_COST
from planner.planning.cost_to_go import cost_to_go
from planner.planning.problem import Problem
from planner.planning.state_grid import default_grid


class Reachability(NamedTuple):
    """From which starts the last column can be reached within the limits.

    Attributes:
        angles_deg: (n_angles,) start angles.
        speeds_deg_s: (n_speeds,) start speeds.
        crossable: (n_speeds, n_angles).
        cost: (n_speeds, n_angles) about what the best plan costs; infinite where there is none.
    """

    angles_deg: FloatArray
    speeds_deg_s: FloatArray
    crossable: BoolArray
    cost: FloatArray


def reachability(problem: Problem) -> Reachability:
    """Tell for every start angle and speed of the default grid whether the path can be crossed, and at what cost.

    The problem's own start is not looked at. "Yes" and "no" are those of the default planner's first pass: a finer
    grid may still find a way through a gap narrower than one sample of the map.
    """
    problem = replace(problem, start_angle_deg=None, start_speed_deg_s=None)
    grid = default_grid(problem)
    to_go = cost_to_go(problem, grid)
    angles = np.arange(grid.angle_count) * 360.0 / grid.angle_count
    start_allowed = np.array([problem.map.is_allowed(0, float(angle)) for angle in angles])
    crossable = (to_go.costs[0] < ANY_COST) & start_allowed
    cost = np.where(crossable, to_go.costs[0].astype(np.float64) * to_go.unit, np.inf)
    return Reachability(angles, grid.speeds_deg_s, crossable, cost)
