"""Plans that the arm can follow: unchanged if it can follow them, otherwise searched, and always verified."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.cell.cell import placement
from planner.cell.scan import load_scan
from planner.cell.scan_path import ScanPath
from planner.commands.plan import smoothed
from planner.defaults import DEFAULT_PLANNER
from planner.geometry.transforms import rotations_z
from planner.kinematics.configuration import Configuration
from planner.map.config_map import ConfigurationMap
from planner.map.map_builder import build_maps
from planner.map.map_problem import map_problem
from planner.map.synthetic_maps import MapFamily, synthetic_map
from planner.planning.dynamic_programming import dynamic_programming
from planner.planning.planners import PLANNERS
from planner.planning.scan_problem import scan_problem
from planner.planning.smoothing import smooth
from planner.plans.arm_check import PlannedArm, arm_fault
from planner.plans.arm_motion import arm_follows, arm_motion
from planner.plans.arm_on_path import ArmOnPath
from planner.plans.plan import Infeasibility, NoPlan, Plan
from planner.plans.problem import Problem
from planner.plans.verification import verify
from planner.search.joint_turns import Margin
from planner.table.motion import Limits, roll_out
from tests.planner.exhaustive_search import is_forbidden_on_the_way
from tests.planner.winding_arm import turns_after, winding_arm

SMALL = MapFamily(0.2, 4.0, location_count=25, angle_count=36)
EXACT = Margin(0.0, 1.0)
plan_for_the_arm = PLANNERS[DEFAULT_PLANNER]


def can_follow(on_path: ArmOnPath, plan: Plan, margin: Margin = EXACT) -> bool:
    joints_deg = None
    for location, angle_deg in enumerate(plan.angles_deg.tolist()):
        joints_deg = turns_after(on_path, location, angle_deg, joints_deg, plan.step_s, margin)
    return joints_deg is not None and all(joints_deg)


def assert_it_is_a_plan_for_table_and_arm(problem: Problem, plan: Plan) -> None:
    assert problem.arm is not None
    assert can_follow(problem.arm, plan)
    assert verify(problem, plan).is_executable
    assert not is_forbidden_on_the_way(problem.map, plan)


@pytest.mark.parametrize("seed", range(3))
def test_what_the_arm_can_follow_anyway_is_kept_to_the_last_bit(seed: int) -> None:
    problem = Problem(synthetic_map(SMALL, seed), step_s=0.3)
    without, outcome = dynamic_programming(problem), plan_for_the_arm(replace(problem, arm=winding_arm(0.0)))
    assert isinstance(without, Plan)
    assert isinstance(outcome, Plan)
    for name in ("angles_deg", "speeds_deg_s", "accelerations_deg_s2"):
        assert np.array_equal(getattr(without, name), getattr(outcome, name))


@settings(max_examples=8, deadline=None)
@given(
    seed=st.integers(0, 1000),
    step_s=st.sampled_from([0.2, 0.5, 1.0]),
    twist_deg=st.floats(-170.0, 170.0),
    range_6_deg=st.floats(50.0, 400.0),
    speed_6_deg_s=st.floats(20.0, 600.0),
    sway_deg=st.floats(0.0, 200.0),
    start_deg=st.none() | st.floats(-400.0, 400.0),
)
def test_every_plan_is_one_for_table_and_arm(
    seed: int, step_s: float, twist_deg: float, range_6_deg: float, speed_6_deg_s: float, sway_deg: float,
    start_deg: float | None,
) -> None:  # fmt: skip
    on_path = winding_arm(twist_deg, range_6_deg, speed_6_deg_s, sway_deg=sway_deg)
    outcome = plan_for_the_arm(Problem(synthetic_map(SMALL, seed), step_s, start_angle_deg=start_deg, arm=on_path))
    if isinstance(outcome, Plan):
        assert_it_is_a_plan_for_table_and_arm(
            Problem(synthetic_map(SMALL, seed), step_s, start_angle_deg=start_deg, arm=on_path), outcome
        )
        assert start_deg is None or outcome.angles_deg[0] == start_deg


@settings(max_examples=6, deadline=None)
@given(
    seed=st.integers(0, 1000),
    twist_deg=st.floats(10.0, 60.0),
    sense=st.sampled_from([-1.0, 1.0]),
    step_s=st.sampled_from([0.4, 1.0]),
)
def test_where_a_motion_is_known_one_is_found(seed: int, twist_deg: float, sense: float, step_s: float) -> None:
    random, limits = np.random.default_rng(seed), Limits()
    # A table that compensates the twist as well as it can, with small variations.
    speeds = -sense * np.minimum(twist_deg / step_s, limits.speed_deg_s) * random.uniform(0.7, 1.0, 24)
    gain = limits.acceleration_deg_s2 * step_s
    accelerations, speed = np.zeros(24), 0.0
    for k, wanted in enumerate(speeds):
        accelerations[k] = np.clip(wanted - speed, -gain, gain) / step_s
        speed += accelerations[k] * step_s
    angles, _ = roll_out(100.0, 0.0, accelerations, step_s)
    joint_6_deg = angles + sense * twist_deg * np.arange(25)
    half_range_deg = 0.5 * np.ptp(joint_6_deg) + 1.0
    fastest_deg_s = 1.02 * np.abs(np.diff(joint_6_deg)).max() / step_s
    # The joint's zero is where the known motion is in the middle of its range, whatever the start turn.
    middle_deg = 0.5 * (joint_6_deg.max() + joint_6_deg.min())
    on_path = winding_arm(sense * twist_deg, half_range_deg, fastest_deg_s, zero_deg=middle_deg)
    values = random.uniform(0.2, 1.0, (25, 36))
    problem = Problem(ConfigurationMap(values), step_s, limits, start_angle_deg=100.0, arm=on_path)
    outcome = plan_for_the_arm(problem)
    assert isinstance(outcome, Plan), outcome
    assert_it_is_a_plan_for_table_and_arm(problem, outcome)


def test_where_there_is_room_a_plan_keeps_a_margin_from_the_limits() -> None:
    problem = Problem(ConfigurationMap(np.ones((40, 36))), step_s=1.0, arm=winding_arm(30.0))
    plan = plan_for_the_arm(problem)
    assert isinstance(plan, Plan)
    assert problem.arm is not None
    assert arm_motion(problem.arm, plan).limit_margins_deg[5] == pytest.approx(5.0, abs=0.5)


def test_without_a_way_the_joint_and_the_location_are_the_reason() -> None:
    outcome = plan_for_the_arm(Problem(ConfigurationMap(np.ones((40, 36))), step_s=1.0, arm=winding_arm(76.0)))
    assert isinstance(outcome, NoPlan)
    assert outcome.infeasibility is Infeasibility.ARM
    assert outcome.reason.endswith("no motion was found that the arm can follow (joint 6 limit, location 20)")


def test_smoothing_that_the_arm_cannot_follow_is_left_out() -> None:
    problem = Problem(synthetic_map(SMALL, 0), step_s=1.0, arm=winding_arm(30.0, 500.0, 20.0))
    rough = plan_for_the_arm(problem)
    assert isinstance(rough, Plan)
    assert not arm_follows(problem, smooth(problem, rough))
    plan = smoothed(plan_for_the_arm)(problem)
    assert isinstance(plan, Plan)
    assert_it_is_a_plan_for_table_and_arm(problem, plan)


@pytest.mark.parametrize(
    ("twist_deg", "table_mm"),
    [(-35.0, (570.0, 0.0, 120.0)), (-12.0, (520.0, 60.0, 100.0)), (16.0, (570.0, 0.0, 120.0))],
)
def test_a_real_scan_with_a_rolling_probe_is_followed_or_refused(
    twist_deg: float, table_mm: tuple[float, float, float]
) -> None:
    scan = load_scan("mould")
    rolled = scan.path.T_WS[:40] @ rotations_z(np.linspace(0.0, 39.0 * twist_deg, 40))
    cell = replace(scan.cell, T_BT=placement(*table_mm, 0.0, 0.0, 0.0))
    scan = replace(scan, cell=cell, predefined_path=ScanPath(rolled, 1.0))
    configuration = Configuration.LEFTY_ABOVE_NOFLIP
    problem = scan_problem(scan, build_maps(map_problem(scan), [configuration], 60)[configuration], None)
    outcome = plan_for_the_arm(problem)
    if isinstance(outcome, NoPlan):
        assert outcome.joint is not None or outcome.infeasibility is not Infeasibility.ARM
        return
    assert problem.arm is not None
    joints_deg = np.degrees(arm_motion(problem.arm, outcome).joints)
    assert arm_fault(PlannedArm(scan.cell, scan.path.T_WS, joints_deg), outcome) is None
    assert verify(problem, outcome).is_executable
