import numpy as np
import pytest

from planner.map.config_map import ConfigurationMap
from planner.map.synthetic_maps import MapFamily, synthetic_map
from planner.planning.local_maxima import local_maxima
from planner.plans.plan import NoPlan, Plan
from planner.plans.problem import Problem


def test_each_location_is_met_at_its_brightest_angle() -> None:
    problem = Problem(synthetic_map(MapFamily(location_count=20, angle_count=36), 1))
    plan = local_maxima(problem)
    assert isinstance(plan, Plan)
    met = [problem.map.value(k, float(angle)) for k, angle in enumerate(plan.angles_deg)]
    assert met == pytest.approx(problem.map.values.max(axis=1))
    assert plan.cost.value == pytest.approx((1.0 - problem.map.values.max(axis=1)[1:]).sum())


def test_it_goes_the_shorter_way_round() -> None:
    values = np.full((3, 36), 0.5)
    values[[0, 1, 2], [1, 35, 2]] = 1.0
    plan = local_maxima(Problem(ConfigurationMap(values)))
    assert isinstance(plan, Plan)
    assert plan.angles_deg.tolist() == [10.0, -10.0, 20.0]


def test_a_blocked_location_is_a_result() -> None:
    assert isinstance(local_maxima(Problem(ConfigurationMap(np.eye(4)[:, :3]))), NoPlan)
