"""The steps of a grid; each connects two of its speeds.

The acceleration of a step, and its travel, depend only on these two speeds.
"""

from typing import NamedTuple

import numpy as np

from planner.arrays import CostArray, IndexArray
from planner.kernel import kernel
from planner.map.config_map import SAMPLE_TOLERANCE, sample_at_or_above, sample_at_or_below
from planner.plans.problem import Terms
from planner.search.state_grid import Grid
from planner.table.cost import acceleration_cost
from planner.table.motion import swept_angles


class Transitions(NamedTuple):
    """The steps from each speed of a grid, with angles in samples of its angle axis.

    Attributes:
        step_count: (n_speeds,) number of steps that stay on the grid; only these entries of a row of the other arrays
            are used.
        target: (n_speeds, n_jumps) speed index at the end of the step.
        shift: (n_speeds, n_jumps) whole samples of the travel, less than a turn in either direction.
        fraction: (n_speeds, n_jumps) fraction of a sample of the travel, 0 .. 1.
        sweep_start: (n_speeds, n_jumps) sample at or below the lowest angle during the step, within a turn.
        sweep_length: (n_speeds, n_jumps) number of cells crossed from there, at most one turn.
        cost: (n_speeds, n_jumps) first term of Eq. (5), in units.
    """

    step_count: IndexArray
    target: IndexArray
    shift: IndexArray
    fraction: CostArray
    sweep_start: IndexArray
    sweep_length: IndexArray
    cost: CostArray


@kernel
def lay_out_transitions(terms: Terms, grid: Grid, unit: float) -> Transitions:
    """Return the steps of the grid, with the jumps in the grid's order; steps that leave the grid are omitted."""
    speeds = 2 * grid.half_count + 1
    shape = (speeds, len(grid.jumps))
    count = np.zeros(speeds, dtype=np.int64)
    target, shift = np.zeros(shape, dtype=np.int64), np.zeros(shape, dtype=np.int64)
    sweep_start, sweep_length = np.zeros(shape, dtype=np.int64), np.zeros(shape, dtype=np.int64)
    fraction, cost = np.zeros(shape, dtype=np.float32), np.zeros(shape, dtype=np.float32)
    for i in range(speeds):
        for jump in grid.jumps:
            j = i + jump
            if not 0 <= j < speeds:
                continue
            a = count[i]
            acceleration = jump * grid.speed_step_deg_s / terms.step_s
            target[i, a] = j
            shift[i, a], fraction[i, a] = _movement(grid, i, j, terms.step_s)
            sweep_start[i, a], sweep_length[i, a] = _sweep(grid, i, acceleration, terms.step_s)
            cost[i, a] = acceleration_cost(terms.acceleration_weight, acceleration) / unit
            count[i] += 1
    return Transitions(count, target, shift, fraction, sweep_start, sweep_length, cost)


@kernel
def _movement(grid: Grid, i: int, j: int, step_s: float) -> tuple[int, float]:
    """Return the whole samples, and the fraction of one, by which the angle moves from speed i to speed j."""
    mean_speed_deg_s = 0.5 * (i + j - 2 * grid.half_count) * grid.speed_step_deg_s
    moved = mean_speed_deg_s * step_s * (grid.angle_count / 360.0)
    whole = sample_at_or_below(moved)
    fraction = moved - whole
    return _within_a_turn(whole, grid.angle_count), fraction if fraction > SAMPLE_TOLERANCE else 0.0


@kernel
def _sweep(grid: Grid, i: int, acceleration_deg_s2: float, step_s: float) -> tuple[int, int]:
    """Return the lowest sample of a step from speed i, counted from its start, and the number of cells crossed."""
    samples_per_deg = grid.angle_count / 360.0
    speed_deg_s = (i - grid.half_count) * grid.speed_step_deg_s
    lowest, highest = swept_angles(0.0, speed_deg_s, acceleration_deg_s2, step_s)
    first = sample_at_or_below(lowest * samples_per_deg)
    last = sample_at_or_above(highest * samples_per_deg)
    return _within_a_turn(first, grid.angle_count), min(last - first, grid.angle_count)


@kernel
def _within_a_turn(samples: int, turn: int) -> int:
    """Return the samples without their whole turns; short distances keep their sign."""
    return samples % turn if samples >= 0 else -(-samples % turn)
