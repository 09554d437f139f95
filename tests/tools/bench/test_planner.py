import math

import numpy as np
import pytest

from planner.map.config_map import ConfigurationMap
from planner.map.synthetic_maps import MapFamily, synthetic_map
from planner.planning.dijkstra import shortest_path
from planner.plans.plan import Plan, make_plan
from planner.plans.problem import Problem
from planner.search.lattice_choice import turn_lattice
from planner.table.motion import Limits, roll_out
from tools.bench.default_planner import can_be_executed, lattice_optimum, measure
from tools.bench.planner import median_seconds
from tools.bench.planner_families import FAMILIES, Family


def test_what_plans_are_measured_against_is_the_optimum_of_scipys_graph() -> None:
    problem = Problem(synthetic_map(MapFamily(0.2, 3.0, location_count=8, angle_count=90), 1), 1.0, Limits(40.0, 10.0))
    optimum, lattice = lattice_optimum(problem), turn_lattice(problem, 20, 10_000_000)
    assert lattice is not None
    shortest = shortest_path(problem, lattice)
    assert isinstance(optimum, Plan)
    assert shortest is not None
    assert optimum.cost.total == pytest.approx(shortest.cost, rel=1e-6)


@pytest.mark.parametrize("family", FAMILIES, ids=lambda family: family.name)
def test_of_each_family_a_way_that_exists_is_found_and_can_be_executed(family: Family) -> None:
    case = measure(family.problem(1))
    assert not case.is_missed
    assert case.is_executable
    assert math.isfinite(case.cost) or case.is_proved


def test_a_plan_through_a_forbidden_sub_step_is_not_executable() -> None:
    values = np.ones((3, 36))
    values[1, 9:20] = 0.0
    problem = Problem(ConfigurationMap(values), 1.0)
    through = make_plan(problem, "through", *roll_out(50.0, 20.0, np.array([20.0, 20.0]), 1.0), np.array([20.0, 20.0]))
    beside = make_plan(problem, "beside", np.full(3, 50.0), np.zeros(3), np.zeros(2))
    assert not can_be_executed(problem, through)
    assert can_be_executed(problem, beside)


def test_a_time_is_measured_after_compiling() -> None:
    calls = []
    assert median_seconds(lambda: calls.append(1), repeats=4) >= 0.0
    assert len(calls) == 5
