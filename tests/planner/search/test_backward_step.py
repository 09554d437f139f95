"""The vectorized step compared with Bellman's equation, state by state, in double precision."""

import numpy as np
import numpy.typing as npt
import pytest

from planner.arrays import CostArray, FloatArray
from planner.map.synthetic_maps import MapFamily, synthetic_map
from planner.plans.problem import Problem
from planner.search.backward_step import ANY_COST, NO_PAUSE, UNREACHABLE, prepare_backward_step, step_back
from planner.search.state_grid import Grid, default_grid
from planner.search.transitions import lay_out_transitions
from planner.table.motion import Limits

# 37 angles are not a multiple of the vector length; with 12 s a step turns by more than a turn.
PROBLEM = Problem(synthetic_map(MapFamily(location_count=10, angle_count=37), 0), step_s=0.4)
TURNING = Problem(PROBLEM.map, step_s=12.0, limits=Limits(40.0, 5.0))


def written_out(
    problem: Problem, grid: Grid, later: FloatArray, node_cost: FloatArray, sweep: npt.NDArray[np.int32]
) -> FloatArray:
    """Return the minimum cost of leaving each state of a column."""
    steps = lay_out_transitions(problem.terms, grid, 1.0)
    earlier = np.full(later.shape, np.inf)
    for (i, m), _ in np.ndenumerate(later):
        for a in range(steps.step_count[i]):
            j, fraction = steps.target[i, a], float(steps.fraction[i, a])
            ends = [(m + steps.shift[i, a] + n) % grid.angle_count for n in (0, 1)]
            weights = [1.0 - fraction, fraction]
            onward = sum(w * (node_cost[n] + later[j, n]) for n, w in zip(ends, weights, strict=True) if w > 0.0)
            if sweep[(m + steps.sweep_start[i, a]) % grid.angle_count] >= steps.sweep_length[i, a]:
                arrival = problem.terms.speed_weight * grid.speeds_deg_s[j] ** 2
                earlier[i, m] = min(earlier[i, m], steps.cost[i, a] + arrival + onward)
    return earlier


def stepped_back(
    problem: Problem, grid: Grid, later: FloatArray, node_cost: FloatArray, sweep: npt.NDArray[np.int32], pause: float
) -> CostArray:
    earlier = np.empty(later.shape, dtype=np.float32)
    backward = prepare_backward_step(problem.terms, grid, 1.0)
    step_back(backward, single(later), single(node_cost), sweep, pause, earlier)
    return earlier


def single(costs: FloatArray) -> CostArray:
    return np.where(np.isfinite(costs), costs, UNREACHABLE).astype(np.float32)


def random_column(grid: Grid, seed: int) -> tuple[FloatArray, FloatArray, npt.NDArray[np.int32]]:
    """Return costs, some of them infinite, and sweeps of -1 (forbidden) to a few cells."""
    random = np.random.default_rng(seed)
    later = random.uniform(0.0, 50.0, (2 * grid.half_count + 1, grid.angle_count))
    later[random.random(later.shape) < 0.1] = np.inf
    node_cost = np.where(random.random(grid.angle_count) < 0.1, np.inf, random.random(grid.angle_count))
    return later, node_cost, random.integers(-1, 12, grid.angle_count).astype(np.int32)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("problem", [PROBLEM, TURNING], ids=["part of a turn", "more than a turn"])
def test_a_step_back_takes_the_cheapest_way_of_leaving_each_state(problem: Problem, seed: int) -> None:
    grid = default_grid(problem, refinement=1, speed_count=15)
    later, node_cost, sweep = random_column(grid, seed)
    sweep = np.where(sweep > 8, grid.angle_count, sweep).astype(np.int32)
    expected = written_out(problem, grid, later, node_cost, sweep)
    earlier = stepped_back(problem, grid, later, node_cost, sweep, NO_PAUSE)
    assert 0.1 < np.isfinite(expected).mean() < 1.0
    assert np.array_equal(earlier < ANY_COST, np.isfinite(expected))
    assert np.all(earlier[np.isinf(expected)] == UNREACHABLE)
    assert earlier[np.isfinite(expected)] == pytest.approx(expected[np.isfinite(expected)], rel=1e-5)


def test_a_pause_leads_to_the_best_angle_at_rest_where_no_step_is_cheaper() -> None:
    grid = default_grid(PROBLEM, refinement=1, speed_count=15)
    later, node_cost, sweep = random_column(grid, 1)
    after_pause = (node_cost + later[grid.half_count]).min() + 20.0
    expected = np.minimum(written_out(PROBLEM, grid, later, node_cost, sweep), after_pause)
    earlier = stepped_back(PROBLEM, grid, later, node_cost, sweep, 20.0)
    assert earlier == pytest.approx(expected, rel=1e-5)


def test_a_speed_that_no_step_leaves_has_no_way_on() -> None:
    grid = Grid(37, 0.0, 10.0, 1, np.array([1]))
    open_everywhere = np.full(37, 37, dtype=np.int32)
    earlier = stepped_back(PROBLEM, grid, np.zeros((3, 37)), np.zeros(37), open_everywhere, NO_PAUSE)
    assert np.all(earlier[2] == UNREACHABLE)
    assert np.all(earlier[:2] < ANY_COST)
