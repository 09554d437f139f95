import numpy as np
import pytest

from planner.map.config_map import ConfigurationMap
from planner.map.synthetic_maps import MapFamily, synthetic_map
from planner.planning.dynamic_programming import dynamic_programming
from planner.planning.plan import Plan
from planner.planning.problem import Problem
from planner.planning.reachability import reachability
from tests.planner.exhaustive_search import is_forbidden_on_the_way


def test_a_yes_is_kept_by_the_planner_for_every_start_tried() -> None:
    configuration_map = synthetic_map(MapFamily(0.35, 4.0, location_count=30, angle_count=36), 3)
    answer = reachability(Problem(configuration_map, step_s=0.25))
    generator = np.random.default_rng(0)
    tried = generator.permutation(np.argwhere(answer.crossable))[:25]
    assert 0.05 < answer.crossable.mean() < 0.95
    for j, i in tried:
        problem = Problem(
            configuration_map,
            0.25,
            start_angle_deg=float(answer.angles_deg[i]),
            start_speed_deg_s=float(answer.speeds_deg_s[j]),
        )
        plan = dynamic_programming(problem)
        assert isinstance(plan, Plan)
        assert plan.cost.total == pytest.approx(float(answer.cost[j, i]), rel=0.1)
        assert not is_forbidden_on_the_way(configuration_map, plan)


def test_too_fast_towards_a_wall_cannot_be_crossed() -> None:
    values = np.ones((10, 36))
    values[1:, 20:26] = 0.0
    answer = reachability(Problem(ConfigurationMap(values), step_s=0.5))
    before_the_wall = int(np.flatnonzero(answer.angles_deg == 190.0)[0])
    assert not answer.crossable[-1, before_the_wall]
    assert answer.crossable[0, before_the_wall]
    assert not answer.crossable[:, np.flatnonzero(answer.angles_deg == 220.0)[0]].any()


def test_a_problems_own_start_does_not_matter() -> None:
    configuration_map = synthetic_map(MapFamily(0.3, 4.0, location_count=10, angle_count=36), 1)
    free = reachability(Problem(configuration_map))
    bound = reachability(Problem(configuration_map, start_angle_deg=0.0, start_speed_deg_s=1.0))
    assert np.array_equal(free.crossable, bound.crossable)
