from dataclasses import replace

import numpy as np
import pytest

from planner.map.config_map import ConfigurationMap
from planner.map.synthetic_maps import MapFamily, synthetic_map
from planner.planning.dijkstra import shortest_path
from planner.plans.problem import Problem
from planner.search.backward_step import ANY_COST
from planner.search.cost_to_go import cost_from, cost_to_go
from planner.search.lattice_choice import turn_lattice
from planner.search.state_grid import Grid, GridError, default_grid
from planner.table.cost import Weights
from planner.table.motion import Limits
from tests.planner.exhaustive_search import least_cost

# With a step of 1 s and 10 deg samples, speeds of multiples of 20 deg/s keep every step on the samples.
LIMITS = Limits(60.0, 40.0)


def lattice_problem(seed: int, forbidden: float = 0.3, locations: int = 25) -> Problem:
    family = MapFamily(forbidden, 2.5, location_count=locations, angle_count=36)
    return Problem(synthetic_map(family, seed), step_s=1.0, limits=LIMITS)


# No step of this grid ends between two nodes.
EXACT_GRID = Grid(36, 0.0, 20.0, 3, np.arange(-2, 3))


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("forbidden", [0.15, 0.4])
def test_on_an_exact_lattice_it_is_scipys_shortest_path(seed: int, forbidden: float) -> None:
    problem = replace(lattice_problem(seed, forbidden), start_angle_deg=None)
    to_go = cost_to_go(problem, EXACT_GRID)
    at_rest = to_go.costs[0, to_go.grid.half_count].astype(float) * to_go.unit
    at_rest[~problem.map.allowed[0]] = np.inf
    lattice = turn_lattice(problem, 3, 100_000)
    assert lattice is not None
    # Half of the grid's states at rest: those that a lattice around a sample has.
    assert (lattice.q_count, lattice.half_count) == (18, 3)
    shortest = shortest_path(problem, lattice)
    if shortest is None:
        assert at_rest[::2].min() > ANY_COST
    else:
        assert at_rest[::2].min() == pytest.approx(shortest.cost, rel=1e-5)


@pytest.mark.parametrize("seed", range(6))
def test_on_a_tiny_map_it_is_what_trying_every_motion_finds(seed: int) -> None:
    configuration_map = synthetic_map(MapFamily(0.25, 1.2, location_count=5, angle_count=18), seed)
    start = int(np.argmax(configuration_map.values[0]))
    problem = Problem(configuration_map, step_s=1.0, limits=Limits(40.0, 40.0), start_angle_deg=start * 20.0)
    to_go = cost_to_go(problem, Grid(18, start * 20.0, 40.0, 1, np.arange(-1, 2)))
    found = cost_from(to_go.costs, to_go.grid, 0, to_go.grid.half_count, start * 20.0) * to_go.unit
    assert found == pytest.approx(least_cost(problem, [-40.0, 0.0, 40.0]), rel=1e-5)


def test_turning_the_map_turns_the_cost_to_go() -> None:
    problem = lattice_problem(3)
    turned = replace(problem, map=ConfigurationMap(np.roll(problem.map.values, 7, axis=1)))
    grid = default_grid(problem)
    expected = np.roll(cost_to_go(problem, grid).costs, 7 * 2, axis=2)
    assert cost_to_go(turned, grid).costs == pytest.approx(expected, rel=1e-5)


def test_a_mirrored_map_has_the_cost_of_mirrored_speeds() -> None:
    problem = lattice_problem(4)
    mirrored = replace(problem, map=ConfigurationMap(np.roll(problem.map.values[:, ::-1], 1, axis=1)))
    grid = default_grid(problem)
    expected = np.roll(cost_to_go(problem, grid).costs[:, ::-1, ::-1], 1, axis=2)
    assert cost_to_go(mirrored, grid).costs == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("scale", [1e-30, 1e30, 1e200])
def test_weights_beyond_single_precision_change_nothing_but_the_unit(scale: float) -> None:
    problem = replace(lattice_problem(1, 0.15), weights=Weights(scale, scale))
    costs = cost_to_go(problem, default_grid(problem)).costs
    reachable = costs < ANY_COST
    assert np.all(np.isfinite(costs))
    assert 0.3 < reachable.mean() < 1.0
    assert costs[reachable].max() <= problem.step_count * 1.001


def test_a_cost_to_go_takes_four_bytes_a_state() -> None:
    problem = Problem(synthetic_map(MapFamily(location_count=10), 1))
    to_go = cost_to_go(problem, default_grid(problem))
    speeds = len(to_go.grid.speeds_deg_s)
    assert to_go.costs.nbytes == 4 * 10 * speeds * 200


def test_a_grid_that_would_fill_the_memory_is_refused_with_its_size() -> None:
    # The table gains 5e-6 deg/s a step, and may start at any speed up to 40 deg/s.
    problem = replace(lattice_problem(0), step_s=1e-6, limits=Limits(40.0, 5.0), start_speed_deg_s=None)
    with pytest.raises(GridError, match="allowed are 200,000,000"):
        cost_to_go(problem, default_grid(problem))
