import numpy as np
import pytest

from planner.map.config_map import ConfigurationMap
from planner.map.synthetic_maps import MapFamily, synthetic_map
from planner.planning.interpolated_planner import interpolated_plan
from planner.planning.iterative_dynamic_programming import best_around, refine, tube
from planner.plans.plan import Plan, make_plan
from planner.plans.problem import Problem
from planner.plans.verification import verify
from planner.table.motion import roll_out
from tests.planner.exhaustive_search import is_forbidden_on_the_way
from tools.bench.planner_families import around_a_motion

FAMILY = MapFamily(0.15, 2.0, location_count=40, angle_count=60)


def plan_of(problem: Problem) -> Plan:
    plan = interpolated_plan(problem)
    assert plan is not None
    return plan


@pytest.mark.parametrize("start_angle_deg", [None, 123.4])
@pytest.mark.parametrize("seed", range(4))
def test_the_cost_falls_and_everything_else_is_kept(seed: int, start_angle_deg: float | None) -> None:
    problem = Problem(synthetic_map(FAMILY._replace(forbidden=0.05), seed), 0.25, start_angle_deg=start_angle_deg)
    plan = plan_of(problem)
    refined = refine(problem, plan, 1.0)
    assert refined.cost.total < plan.cost.total
    assert refined.planner == plan.planner
    assert refined.speeds_deg_s[0] == plan.speeds_deg_s[0]
    assert start_angle_deg is None or refined.angles_deg[0] == start_angle_deg
    assert verify(problem, refined).is_executable
    assert not is_forbidden_on_the_way(problem.map, refined)


@pytest.mark.parametrize("seed", range(30))
def test_the_plan_itself_is_never_lost_however_little_room_it_has(seed: int) -> None:
    problem, motion = around_a_motion(seed)
    plan = make_plan(problem, "known", *motion)
    for node_deg in (3.0, 0.3, 0.01):
        lattice = tube(plan, node_deg)
        better = best_around(problem, plan, lattice)
        assert better.cost.total <= plan.cost.total
        assert verify(problem, better).is_executable


def test_a_pass_that_is_refused_is_not_kept() -> None:
    problem = Problem(synthetic_map(FAMILY, 1), 0.25)
    plan = plan_of(problem)
    assert refine(problem, plan, 1.0, accepts=lambda _: False) is plan


def test_a_jerk_on_an_even_map_goes() -> None:
    problem = Problem(ConfigurationMap(np.ones((41, 12))), start_angle_deg=0.0)
    accelerations = np.zeros(40)
    accelerations[15], accelerations[16] = 20.0, -20.0
    plan = make_plan(problem, "jerky", *roll_out(0.0, 0.0, accelerations, problem.step_s), accelerations)
    assert np.abs(refine(problem, plan, 0.2).accelerations_deg_s2).max() == pytest.approx(0.0, abs=1e-9)
