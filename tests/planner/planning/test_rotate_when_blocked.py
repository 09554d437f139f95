import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.map.config_map import ConfigurationMap
from planner.map.synthetic_maps import MapFamily, synthetic_map
from planner.planning.rotate_when_blocked import nearest_allowed_angle, rotate_when_blocked
from planner.plans.plan import Infeasibility, NoPlan, Pause, Plan
from planner.plans.problem import Problem
from tests.planner.exhaustive_search import is_forbidden_on_the_way


def blocked_at(location: int, *samples: int, angles: int = 12) -> ConfigurationMap:
    values = np.ones((4, angles))
    values[location, list(samples)] = 0.0
    return ConfigurationMap(values)


def test_where_the_next_location_is_allowed_the_table_stands_still() -> None:
    plan = rotate_when_blocked(Problem(blocked_at(2, 6), start_angle_deg=30.0))
    assert isinstance(plan, Plan)
    assert plan.angles_deg.tolist() == [30.0] * 4
    assert plan.pauses == ()


def test_where_it_is_not_the_table_turns_and_the_plan_carries_the_pause() -> None:
    # As printed ("if inrange") Algorithm 1 would stay in the forbidden region.
    plan = rotate_when_blocked(Problem(blocked_at(2, 1, 2), start_angle_deg=60.0))
    assert isinstance(plan, Plan)
    assert plan.angles_deg.tolist() == [60.0, 60.0, 90.0, 90.0]
    assert plan.pauses == (Pause(1, 60.0, 90.0),)


def test_the_nearest_angle_wins_and_upwards_is_tried_first() -> None:
    terms = Problem(blocked_at(1, 2, 3, 4)).terms
    assert nearest_allowed_angle(terms, 1, 60.0) == 30.0
    assert nearest_allowed_angle(terms, 1, 90.0) == 150.0
    assert nearest_allowed_angle(terms, 1, 90.0 - 3600.0) == 150.0 - 3600.0


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 40), st.floats(-500.0, 500.0))
def test_the_angle_found_is_allowed_and_none_of_the_samples_is_nearer(seed: int, angle: float) -> None:
    generator = np.random.default_rng(seed)
    configuration_map = ConfigurationMap((generator.random((2, 15)) < 0.2).astype(float))
    found = nearest_allowed_angle(Problem(configuration_map).terms, 1, angle)
    if configuration_map.blocked_locations != () and 1 in configuration_map.blocked_locations:
        assert np.isnan(found)
        return
    assert configuration_map.is_allowed(1, found)
    samples = configuration_map.angles_deg[configuration_map.allowed[1]]
    distances = np.abs((samples - angle + 180.0) % 360.0 - 180.0)
    assert abs(found - angle) <= distances.min() + 1e-6


def test_a_location_without_any_allowed_angle_is_a_result_with_its_reason() -> None:
    outcome = rotate_when_blocked(Problem(blocked_at(2, *range(12)), start_angle_deg=60.0))
    assert isinstance(outcome, NoPlan)
    assert (outcome.infeasibility, outcome.location) == (Infeasibility.BLOCKED_LOCATION, 2)


def test_a_start_in_motion_comes_to_rest_in_a_pause() -> None:
    plan = rotate_when_blocked(Problem(blocked_at(2, 1), start_angle_deg=180.0, start_speed_deg_s=10.0))
    assert isinstance(plan, Plan)
    assert plan.pauses == (Pause(0, 180.0, 180.0),)


@pytest.mark.parametrize("seed", range(4))
def test_it_always_gets_across_where_every_location_has_an_angle(seed: int) -> None:
    problem = Problem(synthetic_map(MapFamily(forbidden=0.5, location_count=40, angle_count=40), seed))
    plan = rotate_when_blocked(problem)
    assert isinstance(plan, Plan)
    assert not is_forbidden_on_the_way(problem.map, plan)
