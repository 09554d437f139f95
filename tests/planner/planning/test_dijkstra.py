import math

import numpy as np
import pytest

from planner.map.config_map import ConfigurationMap
from planner.map.synthetic_maps import MapFamily, synthetic_map
from planner.planning.dijkstra import dijkstra, shortest_path
from planner.plans.plan import Infeasibility, NoPlan, Plan, make_plan
from planner.plans.problem import Problem
from planner.plans.verification import verify
from planner.search.lattice import Lattice
from planner.search.lattice_choice import turn_lattice
from planner.table.motion import Limits
from tests.planner.exhaustive_search import is_forbidden_on_the_way, least_cost


def lattice_of(problem: Problem, speed_count: int) -> Lattice:
    lattice = turn_lattice(problem, speed_count, 100_000)
    assert lattice is not None
    return lattice


@pytest.mark.parametrize("seed", range(6))
def test_on_a_lattice_the_shortest_path_is_what_trying_every_motion_finds(seed: int) -> None:
    configuration_map = synthetic_map(MapFamily(0.25, 1.2, location_count=5, angle_count=18), seed)
    start_deg = 20.0 * int(np.argmax(configuration_map.values[0]))
    problem = Problem(configuration_map, step_s=1.0, limits=Limits(40.0, 40.0), start_angle_deg=start_deg)
    lattice = lattice_of(problem, 2)
    assert (lattice.q_count, lattice.half_count) == (18, 2)
    optimum = least_cost(problem, [-40.0, -20.0, 0.0, 20.0, 40.0])
    outcome = dijkstra(problem, lattice)
    if math.isinf(optimum):
        assert isinstance(outcome, NoPlan)
    else:
        assert isinstance(outcome, Plan)
        assert outcome.cost.total == pytest.approx(optimum)
        assert not is_forbidden_on_the_way(problem.map, outcome)


@pytest.mark.parametrize("seed", range(4))
def test_the_path_in_the_graph_is_the_motion_and_costs_the_same(seed: int) -> None:
    family = MapFamily(0.35, 3.0, 0.3, location_count=30, angle_count=60)
    problem = Problem(synthetic_map(family, seed), step_s=0.25)
    path = shortest_path(problem, lattice_of(problem, 3))
    assert path is not None
    plan = make_plan(problem, "path", *path.motion)
    assert plan.cost.total == pytest.approx(path.cost)
    assert verify(problem, plan).is_executable
    assert not is_forbidden_on_the_way(problem.map, plan)


def test_without_a_lattice_it_takes_one_that_fits_and_its_plan_can_be_executed() -> None:
    problem = Problem(synthetic_map(MapFamily(0.2, 4.0, location_count=30, angle_count=60), 1), step_s=0.25)
    plan = dijkstra(problem)
    assert isinstance(plan, Plan)
    assert verify(problem, plan).is_executable


def test_where_the_graph_has_no_path_none_is_found_and_nothing_is_proved() -> None:
    values = np.zeros((3, 12))
    values[0, 0] = values[1, 5] = values[2, 5] = 1.0
    outcome = dijkstra(Problem(ConfigurationMap(values)))
    assert isinstance(outcome, NoPlan)
    assert outcome.infeasibility is Infeasibility.NOT_FOUND


def test_a_path_may_wind_around_the_turn() -> None:
    values = np.zeros((60, 36))
    for k in range(60):
        values[k, [(k + offset) % 36 for offset in range(-2, 3)]] = 1.0
    problem = Problem(ConfigurationMap(values), step_s=0.5, start_speed_deg_s=None)
    path = shortest_path(problem, lattice_of(problem, 2))
    assert path is not None
    assert path.motion.angles_deg[-1] - path.motion.angles_deg[0] == pytest.approx(590.0, abs=40.0)
