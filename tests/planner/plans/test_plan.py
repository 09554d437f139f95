import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.map.config_map import ConfigurationMap
from planner.map.synthetic_maps import MapFamily, synthetic_map
from planner.plans.plan import Infeasibility, Pause, Plan, greedy_start, make_plan, obvious_infeasibility
from planner.plans.problem import Problem
from planner.table.motion import roll_out
from tests.planner.exhaustive_search import motion


@settings(max_examples=20, deadline=None)
@given(st.lists(st.floats(-100.0, 100.0), min_size=9, max_size=9))
def test_the_cost_by_term_adds_up_to_equation_7(accelerations: list[float]) -> None:
    problem = Problem(synthetic_map(MapFamily(forbidden=0.0, location_count=10, angle_count=30), seed=3))
    angles, speeds = roll_out(20.0, 0.0, np.array(accelerations), problem.step_s)
    plan = make_plan(problem, "test", angles, speeds, np.array(accelerations))
    states = motion((20.0, 0.0), accelerations, problem.step_s)
    terms = problem.terms
    expected = sum(
        terms.acceleration_weight * a**2 + terms.speed_weight * speed**2 + 1.0 - problem.map.value(k + 1, angle)
        for k, (a, (angle, speed)) in enumerate(zip(accelerations, states[1:], strict=True))
    )
    assert plan.cost.total == pytest.approx(expected)


def test_a_forbidden_location_counts_as_black_and_a_pause_as_c_pen() -> None:
    problem = Problem(ConfigurationMap(np.array([[1.0, 1.0], [0.0, 1.0], [0.5, 1.0]])))
    still = np.zeros(2)
    plan = make_plan(problem, "test", np.zeros(3), np.zeros(3), still, [Pause(1, 0.0, 0.0)])
    assert plan.cost == (0.0, 0.0, 1.5, problem.terms.pause_cost)


def test_a_plan_is_read_only() -> None:
    problem = Problem(ConfigurationMap(np.ones((3, 4))))
    plan = make_plan(problem, "test", np.zeros(3), np.zeros(3), np.zeros(2))
    assert isinstance(plan, Plan)
    with pytest.raises(ValueError, match="read-only"):
        plan.angles_deg[0] = 1.0


def test_a_blocked_location_is_named() -> None:
    values = np.ones((5, 4))
    values[3] = 0.0
    no_plan = obvious_infeasibility(Problem(ConfigurationMap(values)), "test")
    assert no_plan is not None
    assert no_plan.infeasibility is Infeasibility.BLOCKED_LOCATION
    assert "location 3" in no_plan.reason


def test_a_forbidden_start_is_told() -> None:
    no_plan = obvious_infeasibility(
        Problem(ConfigurationMap(np.array([[0.0, 1.0]] * 2)), start_angle_deg=360.0), "test"
    )
    assert no_plan is not None
    assert no_plan.infeasibility is Infeasibility.START_FORBIDDEN


def test_a_free_start_is_at_rest_where_it_is_brightest() -> None:
    problem = Problem(ConfigurationMap(np.array([[0.2, 0.9, 0.3, 0.1]] * 2)), start_speed_deg_s=None)
    assert greedy_start(problem) == (90.0, 0.0)
