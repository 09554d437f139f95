from dataclasses import replace

import numpy as np
import pytest

from planner.defaults import DEFAULT_PLANNER
from planner.map.config_map import ConfigurationMap
from planner.map.synthetic_maps import MapFamily, synthetic_map
from planner.planning.planners import PLANNERS
from planner.plans.plan import Pause, Plan, Wait, make_plan
from planner.plans.problem import Problem
from planner.plans.verification import verify
from planner.table.motion import Limits, roll_out


def test_a_step_through_an_obstacle_is_found_even_between_columns() -> None:
    values = np.ones((4, 36))
    values[1, 5] = 0.0
    problem = Problem(ConfigurationMap(values), step_s=1.0, limits=Limits(200.0, 200.0))
    accelerations = np.zeros(3)
    plan = make_plan(problem, "test", *roll_out(0.0, 40.0, accelerations, 1.0), accelerations)
    # 0, 40, 80, 120 deg: columns are allowed, but the obstacle at 50 deg of column 1 is on the path.
    assert verify(problem, plan).forbidden_steps == (1,)
    assert verify(problem, plan).clearance_deg == pytest.approx(10.0)


def test_margins_are_what_is_left_to_the_limits() -> None:
    problem = Problem(ConfigurationMap(np.ones((3, 8))))
    accelerations = np.array([90.0, -120.0])
    plan = make_plan(problem, "test", *roll_out(0.0, 0.0, accelerations, 0.1), accelerations)
    found = verify(problem, plan)
    assert found.speed_margin_deg_s == pytest.approx(31.0)
    assert found.acceleration_margin_deg_s2 == pytest.approx(-20.0)
    assert not found.within_limits
    assert not found.is_executable
    assert found.clearance_deg == np.inf


def test_a_pause_may_turn_through_forbidden_angles_but_not_end_there() -> None:
    values = np.ones((3, 8))
    values[1, 0] = 0.0
    problem = Problem(ConfigurationMap(values))
    angles = np.array([0.0, 45.0, 45.0])
    paused = make_plan(problem, "test", angles, np.zeros(3), np.zeros(2), [Pause(0, 0.0, 45.0)])
    assert verify(problem, paused).is_executable
    blocked = make_plan(problem, "test", np.zeros(3), np.zeros(3), np.zeros(2), [Pause(0, 0.0, 0.0)])
    assert verify(problem, blocked).forbidden_steps == (0, 1)


@pytest.mark.parametrize("location", [0, 1, 2])
def test_a_halt_that_passes_its_angle_into_an_obstacle_is_found_at_every_location(location: int) -> None:
    values, limits = np.ones((3, 36)), Limits(40.0, 20.0)
    problem = Problem(ConfigurationMap(values.copy()), step_s=1.0, limits=limits)
    plan = make_plan(problem, "test", np.array([0.0, 40.0, 80.0]), np.full(3, 40.0), np.zeros(2))
    halted = replace(plan, waits=(Wait(location, 5.0),))
    assert verify(problem, halted).forbidden_steps == ()
    # From 40 deg/s at 20 deg/s2 the table passes the angle by 40 deg.
    values[location, 4 * location + 3] = 0.0
    blocked = Problem(ConfigurationMap(values), step_s=1.0, limits=limits)
    assert verify(blocked, halted).forbidden_steps == (min(location, 1),)


@pytest.mark.parametrize("name", [name for name in PLANNERS if name != "local_maxima"])
@pytest.mark.parametrize("seed", range(3))
def test_every_planner_that_is_to_be_executed_can_be(name: str, seed: int) -> None:
    problem = Problem(synthetic_map(MapFamily(0.3, 4.0, location_count=40, angle_count=50), seed), step_s=0.25)
    plan = PLANNERS[name](problem)
    assert isinstance(plan, Plan)
    assert verify(problem, plan).is_executable
    assert plan.planner == name


def test_the_default_planner_is_one_of_them() -> None:
    assert DEFAULT_PLANNER in PLANNERS
