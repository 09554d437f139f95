"""One backward step of dynamic programming (Bellman's equation): a column's cost-to-go from that of the next column.

Each step connects two speeds of the grid (`transitions.py`). So only the angle, one-dimensional and periodic, is
interpolated. An interpolated value comes from two finite ones or is infinite. So no finite cost crosses the border of
the region from which the map can be crossed.

The innermost loop runs along the angle axis: contiguous, without branches or index arithmetic, in single precision.
"""

from typing import NamedTuple

import numpy as np

from planner.arrays import CostArray, IndexArray
from planner.kernel import kernel
from planner.plans.crossing import RunArray
from planner.plans.problem import Terms
from planner.search.state_grid import Grid
from planner.search.transitions import lay_out_transitions
from planner.table.cost import speed_cost

# Infinity that keeps its effect with a weight of 0, in single precision. An interpolation with it gives a result far
# above ANY_COST. ANY_COST is far above any possible cost of a path, in units of the maximum step cost.
UNREACHABLE = np.float32(1e30)
ANY_COST = np.float32(1e12)
NO_PAUSE = float(UNREACHABLE)
ONE = np.float32(1.0)

# A multiple of the vector length avoids a scalar remainder of the inner loop.
LANES = 8
STEPS_AT_A_TIME = 3


class BackwardStep(NamedTuple):
    """Constants of all backward steps, and work arrays.

    A row of the work arrays has one turn, continued periodically at both ends as far as a step moves.

    Attributes:
        step_count: (n_speeds,) the steps from each speed.
        cost: (n_speeds, n_jumps) first term of Eq. (5).
        arrival_cost: (n_speeds,) second term of Eq. (5).
        fraction: (n_speeds, n_jumps) position between two samples at which a step ends.
        arrival_at: (n_speeds, n_jumps) index in `arrivals`, flattened, at which a step from sample 0 ends.
        barrier_at: (n_speeds, n_jumps) index in `barriers`, flattened, of the angles that it crosses.
        reach: samples of a row before the turn.
        arrivals: (n_speeds, row length) cost of arriving at a speed and angle and continuing from there.
        barriers: (n_lengths, row length) 0 if the given number of cells upward may be crossed, infinity if not.
        best: minimum cost of leaving a speed, per angle.
    """

    step_count: IndexArray
    cost: CostArray
    arrival_cost: CostArray
    fraction: CostArray
    arrival_at: IndexArray
    barrier_at: IndexArray
    reach: int
    arrivals: CostArray
    barriers: CostArray
    best: CostArray


def prepare_backward_step(terms: Terms, grid: Grid, unit: float) -> BackwardStep:
    """Return the data for `step_back` on a grid, with costs in a unit."""
    steps = lay_out_transitions(terms, grid, unit)
    reach = int(max(np.abs(steps.shift).max(), np.abs(steps.sweep_start).max()))
    width = -(-grid.angle_count // LANES) * LANES
    row_length = reach + width + reach + 1
    return BackwardStep(
        step_count=steps.step_count,
        cost=steps.cost,
        arrival_cost=(speed_cost(terms.speed_weight, 1.0) / unit * grid.speeds_deg_s**2).astype(np.float32),
        fraction=steps.fraction,
        arrival_at=steps.target * row_length + reach + steps.shift,
        barrier_at=steps.sweep_length * row_length + reach + steps.sweep_start,
        reach=reach,
        arrivals=np.empty((len(steps.step_count), row_length), dtype=np.float32),
        barriers=np.empty((int(steps.sweep_length.max()) + 1, row_length), dtype=np.float32),
        best=np.empty(width, dtype=np.float32),
    )


@kernel
def step_back(
    backward: BackwardStep,
    later: CostArray,
    node_cost: CostArray,
    sweep: RunArray,
    pause_price: float,
    earlier: CostArray,
) -> None:
    """Write the cost-to-go of a column, given that of the next.

    Args:
        backward: from `prepare_backward_step`; its work arrays are overwritten.
        later: (n_speeds, n_angles) cost-to-go of the next column.
        node_cost: (n_angles,) 1 - f_R there, in units.
        sweep: (n_angles,) number of cells that may be crossed upward from each angle within the step.
        pause_price: units of cost for stopping the scan and continuing from rest at any angle; NO_PAUSE excludes
            pauses.
        earlier: (n_speeds, n_angles) output.
    """
    arrivals, barriers, best = backward.arrivals, backward.barriers, backward.best
    _lay_out_arrivals(later, node_cost, backward.arrival_cost, backward.reach, arrivals)
    _lay_out_barriers(sweep, backward.reach, barriers)
    at_rest = arrivals[len(arrivals) // 2]
    after_pause = np.float32(at_rest.min() + pause_price)
    flat_arrivals, flat_barriers = arrivals.ravel(), barriers.ravel()
    for speed in range(len(arrivals)):
        best[:] = after_pause
        _leave(speed, backward, flat_arrivals, flat_barriers, best)
        for m in range(len(sweep)):
            earlier[speed, m] = best[m] if best[m] < ANY_COST else UNREACHABLE


@kernel
def _lay_out_arrivals(
    later: CostArray, node_cost: CostArray, arrival_cost: CostArray, reach: int, arrivals: CostArray
) -> None:
    """Write the cost of arriving in the next column and continuing from there."""
    for j in range(len(arrival_cost)):
        row, onward, cost = arrivals[j], later[j], arrival_cost[j]
        turn = row[reach:]
        for m in range(len(node_cost)):
            turn[m] = min(node_cost[m] + cost + onward[m], UNREACHABLE)
        _continue_periodically(row, reach, len(node_cost))


@kernel
def _lay_out_barriers(sweep: RunArray, reach: int, barriers: CostArray) -> None:
    """Write, for each length of the crossed range and its first sample, 0 if it is allowed and infinity if not."""
    for length in range(len(barriers)):
        row = barriers[length]
        turn = row[reach:]
        for m in range(len(sweep)):
            turn[m] = 0.0 if sweep[m] >= length else UNREACHABLE
        _continue_periodically(row, reach, len(sweep))


@kernel
def _continue_periodically(row: CostArray, start: int, period: int) -> None:
    """Fill the row before and after the period that begins at `start`."""
    for m in range(start):
        row[m] = row[m + period]
    for m in range(start + period, len(row)):
        row[m] = row[m - period]


@kernel
def _leave(speed: int, backward: BackwardStep, arrivals: CostArray, barriers: CostArray, best: CostArray) -> None:
    """Reduce `best`, the minimum cost of leaving a speed, per angle, to that of the best of its steps.

    Three steps at a time share the overhead of the innermost loop.
    """
    onward, swept = backward.arrival_at[speed], backward.barrier_at[speed]
    cost, fraction = backward.cost[speed], backward.fraction[speed]
    last = backward.step_count[speed] - 1
    for a in range(0, last + 1, STEPS_AT_A_TIME):
        b, c = min(a + 1, last), min(a + 2, last)
        row_a, row_b, row_c = arrivals[onward[a] :], arrivals[onward[b] :], arrivals[onward[c] :]
        barrier_a, barrier_b, barrier_c = barriers[swept[a] :], barriers[swept[b] :], barriers[swept[c] :]
        cost_a, cost_b, cost_c = cost[a], cost[b], cost[c]
        upper_a, upper_b, upper_c = fraction[a], fraction[b], fraction[c]
        lower_a, lower_b, lower_c = ONE - upper_a, ONE - upper_b, ONE - upper_c
        for m in range(len(best)):
            total_a = cost_a + barrier_a[m] + lower_a * row_a[m] + upper_a * row_a[m + 1]
            total_b = cost_b + barrier_b[m] + lower_b * row_b[m] + upper_b * row_b[m + 1]
            total_c = cost_c + barrier_c[m] + lower_c * row_c[m] + upper_c * row_c[m + 1]
            best[m] = min(min(min(best[m], total_a), total_b), total_c)  # noqa: PLW3301 - this form is vectorized
