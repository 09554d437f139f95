"""The grid of angles and speeds on which a cost-to-go is sampled."""

import math
from typing import NamedTuple

import numpy as np

from planner.arrays import FloatArray, IndexArray
from planner.errors import PlannerError
from planner.map.config_map import SAMPLE_TOLERANCE
from planner.plans.problem import Problem

# With this many samples over one turn, angles between them bring no improvement.
CLOSE_SAMPLES = 720


class GridError(PlannerError):
    """A grid that does not fit into memory."""


class Grid(NamedTuple):
    """The sampling points of a cost-to-go.

    Attributes:
        angle_count: number of angles over one turn.
        angle_origin_deg: the first angle.
        speed_step_deg_s: distance of neighboring speeds.
        half_count: speeds are from -half_count to half_count steps.
        jumps: (n_jumps,) the allowed changes of speed in a step, in speed steps, ascending.
    """

    angle_count: int
    angle_origin_deg: float
    speed_step_deg_s: float
    half_count: int
    jumps: IndexArray

    @property
    def speeds_deg_s(self) -> FloatArray:
        """The (2 half_count + 1,) speeds of the grid, ascending."""
        top_deg_s = self.half_count * self.speed_step_deg_s
        return np.linspace(-top_deg_s, top_deg_s, 2 * self.half_count + 1)

    def state_count(self, column_count: int) -> int:
        """Return the number of states of a cost-to-go over the given number of columns."""
        return column_count * (2 * self.half_count + 1) * self.angle_count


def ladder(reach: int, count: int) -> IndexArray:
    """Return up to `count` changes of speed within `reach` grid steps: odd, symmetric, with 0, denser near 0."""
    half = (count - 1) // 2
    rungs = {max(i, round(reach * (i / half) ** 2)) for i in range(half + 1)} if half else {0}
    positive = sorted(rung for rung in rungs if rung <= reach)
    return np.array(sorted({sign * rung for rung in positive for sign in (-1, 1)}), dtype=np.int64)


def default_grid(
    problem: Problem, refinement: int | None = None, speed_count: int = 61, jump_count: int = 15, least_reach: int = 4
) -> Grid:
    """Return a grid with the full acceleration among its jumps.

    If the table is slow to gain speed, the grid has more speeds, so that at least `least_reach` jumps in each direction
    exist. If it cannot reach its maximum speed within the map, the grid ends at the reachable speed.

    Args:
        problem: the problem.
        refinement: angles of the grid per sample of the map; by default two, or one if the samples are close.
        speed_count: approximate number of speeds.
        jump_count: maximum number of changes of speed per step.
        least_reach: minimum number of speed steps within the acceleration limit.
    """
    if refinement is None:
        refinement = 2 if problem.map.angle_count <= CLOSE_SAMPLES else 1
    angle_count = problem.map.angle_count * refinement
    half = (speed_count - 1) // 2
    gain_deg_s = problem.limits.acceleration_deg_s2 * problem.step_s
    top_deg_s = problem.attainable_speed_deg_s
    if gain_deg_s >= 2.0 * top_deg_s:
        return Grid(angle_count, 0.0, top_deg_s / half, half, ladder(2 * half, jump_count))
    reach = max(least_reach, round(gain_deg_s * half / top_deg_s))
    step_deg_s = gain_deg_s / reach
    half_count = max(1, math.floor(top_deg_s / step_deg_s + SAMPLE_TOLERANCE))
    return Grid(angle_count, 0.0, step_deg_s, half_count, ladder(reach, jump_count))
