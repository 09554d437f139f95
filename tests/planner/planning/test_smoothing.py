import numpy as np
import pytest

from planner.map.config_map import ConfigurationMap
from planner.map.synthetic_maps import MapFamily, synthetic_map
from planner.planning.ray_shooting import ray_shooting
from planner.planning.receding import receding
from planner.planning.smoothing import smooth
from planner.plans.plan import Plan, make_plan
from planner.plans.problem import Problem
from planner.table.motion import roll_out
from tests.planner.exhaustive_search import is_forbidden_on_the_way, motion


def peak(plan: Plan) -> float:
    return float(np.abs(plan.accelerations_deg_s2).max())


@pytest.mark.parametrize("planner", [ray_shooting, receding])
@pytest.mark.parametrize("seed", range(6))
def test_peaks_fall_and_neither_cost_nor_risk_rises(planner: type, seed: int) -> None:
    problem = Problem(synthetic_map(MapFamily(0.3, 4.0, location_count=50, angle_count=60), seed), step_s=0.25)
    plan = planner(problem)
    assert isinstance(plan, Plan)
    smoother = smooth(problem, plan)
    assert peak(smoother) <= peak(plan)
    assert (smoother.accelerations_deg_s2**4).sum() < (plan.accelerations_deg_s2**4).sum()
    assert smoother.cost.total <= plan.cost.total
    assert not is_forbidden_on_the_way(problem.map, smoother)
    assert np.abs(smoother.speeds_deg_s).max() <= problem.limits.speed_deg_s + 1e-9
    assert smoother.pauses == plan.pauses


@pytest.mark.parametrize("seed", range(3))
def test_a_smoothed_plan_still_obeys_equations_3_and_4(seed: int) -> None:
    problem = Problem(synthetic_map(MapFamily(0.1, 6.0, location_count=50, angle_count=60), seed))
    plan = ray_shooting(problem)
    assert isinstance(plan, Plan)
    assert plan.pauses == ()
    smoother = smooth(problem, plan)
    states = np.array(motion((plan.angles_deg[0], 0.0), list(smoother.accelerations_deg_s2), problem.step_s))
    assert smoother.angles_deg == pytest.approx(states[:, 0], abs=1e-9)
    assert smoother.speeds_deg_s == pytest.approx(states[:, 1], abs=1e-9)


def test_a_single_jerk_on_an_even_map_is_spread_out() -> None:
    problem = Problem(ConfigurationMap(np.ones((41, 12))), start_angle_deg=0.0)
    accelerations = np.zeros(40)
    accelerations[15], accelerations[25] = 100.0, -100.0
    plan = make_plan(problem, "jerky", *roll_out(0.0, 0.0, accelerations, problem.step_s), accelerations)
    smoother = smooth(problem, plan)
    assert peak(smoother) < 40.0
    assert smoother.angles_deg[-1] == pytest.approx(plan.angles_deg[-1])
    assert smoother.planner == "jerky+smoothing"


def test_a_plan_that_cannot_be_improved_is_left_alone() -> None:
    problem = Problem(ConfigurationMap(np.ones((11, 12))))
    still = make_plan(problem, "still", np.zeros(11), np.zeros(11), np.zeros(10))
    assert smooth(problem, still).angles_deg.tolist() == [0.0] * 11
