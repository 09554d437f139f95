import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.map.synthetic_maps import MapFamily, synthetic_map
from planner.planning.arm_planning import TIGHT, start_states
from planner.plans.arm_motion import arm_motion
from planner.plans.arm_on_path import ArmOnPath
from planner.plans.plan import make_plan
from planner.plans.problem import Problem
from planner.reasons import Reason
from planner.search.joint_turns import Margin, lay_out_turns
from planner.search.lattice import Lattice
from planner.search.node_joints import node_joints
from planner.search.reference_motion import reference_motion
from planner.search.turn_search import NotFound, find_path
from planner.table.motion import Limits, Motion
from tests.planner.winding_arm import least_cost_followed, winding_arm

# 18 angles of rest, 20 deg apart, and speeds of 20 deg/s.
ACCELERATIONS = [-40.0, -20.0, 0.0, 20.0, 40.0]


def tiny_problem(seed: int, forbidden: float = 0.2) -> Problem:
    configuration_map = synthetic_map(MapFamily(forbidden, 1.2, location_count=5, angle_count=18), seed)
    start_deg = 20.0 * int(np.argmax(configuration_map.values[0]))
    return Problem(configuration_map, step_s=1.0, limits=Limits(40.0, 40.0), start_angle_deg=start_deg)


def search(problem: Problem, on_path: ArmOnPath, margin: Margin = TIGHT) -> Motion | NotFound:
    lattice = Lattice(reference_motion(problem), 10.0, 2, 0, 18, is_closed=True)
    joints = node_joints(on_path, lattice)
    turns = lay_out_turns(on_path.arm, joints, problem.step_s, margin)
    return find_path(problem, lattice, joints, turns, start_states(problem, lattice))


def assert_it_is_the_optimum(problem: Problem, on_path: ArmOnPath, margin: Margin) -> bool:
    optimum, first_unreached = least_cost_followed(problem, on_path, ACCELERATIONS, margin)
    found = search(problem, on_path, margin)
    if isinstance(found, NotFound):
        assert math.isinf(optimum)
        assert found.location == first_unreached
        return False
    plan = make_plan(problem, "search", *found)
    assert plan.cost.total == pytest.approx(optimum, rel=1e-5)
    assert arm_motion(on_path, plan).step is None
    return True


@pytest.mark.parametrize("twist_deg", [-95.0, -50.0, 35.0, 70.0, 110.0, 173.0])
def test_it_finds_what_trying_every_motion_finds(twist_deg: float) -> None:
    found = [
        assert_it_is_the_optimum(tiny_problem(seed), winding_arm(twist_deg, range_6_deg=195.0), TIGHT)
        for seed in range(3)
    ]
    assert len(found) == 3


@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 1000),
    forbidden=st.sampled_from([0.0, 0.2, 0.4]),
    twist_deg=st.floats(-175.0, 175.0),
    range_6_deg=st.floats(60.0, 400.0),
    speed_6_deg_s=st.floats(20.0, 300.0),
    sway_deg=st.floats(0.0, 250.0),
    turns_4=st.integers(-1, 1),
    limit_deg=st.floats(0.001, 20.0),
)
def test_verdict_cost_and_first_location_are_those_of_trying_every_motion(
    seed: int, forbidden: float, twist_deg: float, range_6_deg: float, speed_6_deg_s: float, sway_deg: float,
    turns_4: int, limit_deg: float,
) -> None:  # fmt: skip
    on_path = winding_arm(twist_deg, range_6_deg, speed_6_deg_s, sway_deg=sway_deg, turns_4=turns_4)
    assert_it_is_the_optimum(tiny_problem(seed, forbidden), on_path, Margin(limit_deg, 0.9))


@pytest.mark.parametrize(
    ("on_path", "location", "limit"),
    [
        # From 0 deg joint 6 turns by at least 80, 60 and 60 deg.
        (winding_arm(100.0, range_6_deg=185.0), 3, Reason.JOINT_6_LIMIT),
        # From rest the table takes over 20 of 60 deg.
        (winding_arm(60.0, speed_6_deg_s=35.0), 1, Reason.JOINT_6_SPEED),
    ],
)
def test_the_first_location_without_a_way_and_the_limit_that_bars_it_are_told(
    on_path: ArmOnPath, location: int, limit: Reason
) -> None:
    found = search(replace(tiny_problem(0, forbidden=0.0), start_angle_deg=0.0), on_path)
    assert isinstance(found, NotFound)
    assert found == NotFound(location, limit)


def test_a_node_met_again_after_a_turn_is_on_the_same_turn_of_the_joints() -> None:
    # At 110 and 470 deg joint 6 is half a turn from its middle, where rounding chooses.
    problem = replace(tiny_problem(0), start_angle_deg=120.0)
    lattice = Lattice(reference_motion(problem), 10.0, 2, 0, 18, is_closed=True)
    joints = node_joints(winding_arm(35.0), lattice)
    assert np.array_equal(joints[:, :, :-18], joints[:, :, 18:])
