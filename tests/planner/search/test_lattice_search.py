"""The vectorized search compared with scipy's shortest path, and with all motions."""

import math

import numpy as np
import pytest

from planner.map.synthetic_maps import MapFamily, synthetic_map
from planner.planning.dijkstra import shortest_path
from planner.plans.plan import make_plan
from planner.plans.problem import Problem
from planner.plans.verification import verify
from planner.search.lattice import ANY_COST, UNREACHABLE, Lattice
from planner.search.lattice_choice import turn_lattice
from planner.search.lattice_cost_to_go import cost_to_go
from planner.search.lattice_search import best_motion
from planner.table.cost import Weights
from planner.table.motion import Limits
from tests.planner.exhaustive_search import least_cost


def lattice_of(problem: Problem, speed_count: int) -> Lattice:
    lattice = turn_lattice(problem, speed_count, 1_000_000)
    assert lattice is not None
    return lattice


def best_cost(problem: Problem, lattice: Lattice) -> float:
    motion = best_motion(problem, lattice)
    if motion is None:
        return math.inf
    plan = make_plan(problem, "lattice", *motion)
    assert verify(problem, plan).is_executable
    return plan.cost.total


@pytest.mark.parametrize("forbidden", [0.1, 0.25, 0.4])
@pytest.mark.parametrize("seed", range(6))
def test_on_a_tiny_map_it_finds_what_trying_every_motion_finds(seed: int, forbidden: float) -> None:
    configuration_map = synthetic_map(MapFamily(forbidden, 1.2, location_count=5, angle_count=18), seed)
    start_deg = 20.0 * int(np.argmax(configuration_map.values[0]))
    problem = Problem(configuration_map, step_s=1.0, limits=Limits(40.0, 40.0), start_angle_deg=start_deg)
    lattice = lattice_of(problem, 2)
    assert (lattice.q_count, lattice.half_count) == (18, 2)
    assert best_cost(problem, lattice) == pytest.approx(least_cost(problem, [-40.0, -20.0, 0.0, 20.0, 40.0]))


@pytest.mark.parametrize("start_speed_deg_s", [0.0, -17.3, 38.0, None])
@pytest.mark.parametrize("start_angle_deg", [None, -777.7])
@pytest.mark.parametrize("family", [MapFamily(0.3, 2.0), MapFamily(0.15, 1.0), MapFamily(0.0, 3.0)])
def test_its_path_is_scipys_shortest_path(
    family: MapFamily, start_angle_deg: float | None, start_speed_deg_s: float | None
) -> None:
    found = 0
    for seed in range(6):
        problem = Problem(
            synthetic_map(family._replace(location_count=20, angle_count=36), seed),
            step_s=(0.2, 0.3, 1.0)[seed % 3],
            start_angle_deg=start_angle_deg,
            start_speed_deg_s=start_speed_deg_s,
        )
        lattice = lattice_of(problem, 3)
        shortest = shortest_path(problem, lattice)
        found += shortest is not None
        expected = math.inf if shortest is None else shortest.cost
        assert best_cost(problem, lattice) == pytest.approx(expected, rel=1e-6)
    assert found >= 2


def test_a_step_of_more_than_a_turn_is_searched_too() -> None:
    problem = Problem(synthetic_map(MapFamily(0.0, 4.0, location_count=10, angle_count=24), 0), 12.0, Limits(40.0, 5.0))
    lattice = lattice_of(problem, 3)
    shortest = shortest_path(problem, lattice)
    assert shortest is not None
    assert best_cost(problem, lattice) == pytest.approx(shortest.cost, rel=1e-6)


@pytest.mark.parametrize("scale", [1e-30, 1e30, 1e200])
def test_weights_beyond_single_precision_change_nothing_but_the_unit(scale: float) -> None:
    family = MapFamily(0.15, 2.5, location_count=25, angle_count=36)
    problem = Problem(synthetic_map(family, 1), 0.5, weights=Weights(scale, scale))
    costs = cost_to_go(problem.terms, lattice_of(problem, 3))
    reachable = costs < ANY_COST
    assert 0.3 < reachable.mean() < 1.0
    assert np.all(costs[~reachable] == UNREACHABLE)
    assert np.all(costs.min(axis=(1, 2)) == 0.0)
