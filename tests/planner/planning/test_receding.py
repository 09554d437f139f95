from dataclasses import replace

import numpy as np
import pytest

from planner.map.config_map import ConfigurationMap
from planner.map.synthetic_maps import MapFamily, synthetic_map
from planner.planning.dynamic_programming import dynamic_programming
from planner.planning.receding import HorizonError, online_step, prepare_online_step, receding
from planner.plans.plan import NoPlan, Plan
from planner.plans.problem import Problem
from planner.search.cost_to_go import lay_out_columns
from tests.planner.exhaustive_search import is_forbidden_on_the_way

FAMILY = MapFamily(0.3, 5.0, location_count=60, angle_count=60)


def crossable_problem(seed: int) -> tuple[Problem, Plan]:
    problem = Problem(synthetic_map(FAMILY, seed), step_s=0.25)
    optimal = dynamic_programming(problem)
    assert isinstance(optimal, Plan)
    return replace(problem, start_angle_deg=float(optimal.angles_deg[0])), optimal


@pytest.mark.parametrize("seed", range(4))
def test_with_enough_columns_in_view_it_comes_close_to_the_optimum(seed: int) -> None:
    problem, optimal = crossable_problem(seed)
    plan = receding(problem, columns_in_view=50)
    assert isinstance(plan, Plan)
    assert plan.pauses == ()
    assert plan.cost.total <= 1.05 * optimal.cost.total


@pytest.mark.parametrize("columns_in_view", [1, 5, 20, 1000])
@pytest.mark.parametrize("seed", range(3))
def test_outside_pauses_it_is_never_forbidden_and_within_limits(seed: int, columns_in_view: int) -> None:
    problem, _ = crossable_problem(seed)
    plan = receding(problem, columns_in_view)
    assert isinstance(plan, Plan)
    assert not is_forbidden_on_the_way(problem.map, plan)
    assert np.abs(plan.speeds_deg_s).max() <= problem.limits.speed_deg_s + 1e-9
    assert np.abs(plan.accelerations_deg_s2).max() <= problem.limits.acceleration_deg_s2 + 1e-9


def test_a_step_depends_on_nothing_behind_the_view() -> None:
    problem, _ = crossable_problem(1)
    values = problem.map.values.copy()
    values[21:] = values[:39]
    other = replace(problem, map=ConfigurationMap(values))
    ahead = []
    for asked in (problem, other):
        online = prepare_online_step(asked)
        columns = lay_out_columns(asked.terms, online.grid, online.unit)
        start = float(problem.start_angle_deg or 0.0)
        ahead.append(online_step(asked.terms, online, *columns, 0, 20, start, 0.0))
    assert ahead[0] == ahead[1]


def test_a_wall_takes_one_pause_that_ends_where_the_way_on_is_open() -> None:
    # Behind the wall the nearest angle leads into a pocket; Algorithm 1 would have to pause twice.
    values = np.ones((30, 36))
    values[10, :20] = 0.0
    values[10, 23:] = 0.0
    values[14:, 16:30] = 0.0
    values[11:14, 20:23] = 1.0
    values[10, 5] = 0.5
    problem = Problem(ConfigurationMap(values), start_angle_deg=180.0)
    plan = receding(problem, columns_in_view=25)
    assert isinstance(plan, Plan)
    assert len(plan.pauses) == 1
    assert not is_forbidden_on_the_way(problem.map, plan)
    assert plan.cost.pauses == problem.terms.pause_cost


def test_it_does_not_pause_for_brightness_alone() -> None:
    values = np.full((20, 36), 0.05)
    values[:, 18] = 1.0
    plan = receding(Problem(ConfigurationMap(values), start_angle_deg=0.0))
    assert isinstance(plan, Plan)
    assert plan.pauses == ()


def test_a_blocked_location_is_a_result() -> None:
    values = np.ones((6, 8))
    values[4] = 0.0
    assert isinstance(receding(Problem(ConfigurationMap(values))), NoPlan)


def test_a_view_of_nothing_is_refused() -> None:
    with pytest.raises(HorizonError, match="1 or more"):
        receding(Problem(ConfigurationMap(np.ones((6, 8)))), columns_in_view=0)
