from dataclasses import replace

import numpy as np
import pytest

from planner.cell.scan import Scan, load_scan
from planner.kinematics.configuration import Configuration
from planner.kinematics.inverse_kinematics import inverse_kinematics
from planner.map.map_builder import build_maps
from planner.map.map_problem import map_problem
from planner.planning.rotate_when_blocked import rotate_when_blocked
from planner.planning.scan_problem import scan_problem
from planner.plans.arm_motion import arm_motion
from planner.plans.arm_on_path import arm_on_path
from planner.plans.plan import Plan
from tests.planner.goals import goal_flange_poses

CONFIGURATION = Configuration.LEFTY_ABOVE_NOFLIP


@pytest.fixture(scope="module")
def scan() -> Scan:
    return load_scan("cylinder")


@pytest.fixture(scope="module")
def plan(scan: Scan) -> Plan:
    """A plan with a pause at nearly every location, over more than one turn."""
    configuration_map = build_maps(map_problem(scan), [CONFIGURATION], 60)[CONFIGURATION]
    outcome = rotate_when_blocked(scan_problem(scan, configuration_map, None))
    assert isinstance(outcome, Plan)
    assert len(outcome.pauses) > 10
    return outcome


def test_the_joints_put_the_probe_where_the_plan_says(scan: Scan, plan: Plan) -> None:
    motion = arm_motion(arm_on_path(scan, CONFIGURATION), plan)
    poses = goal_flange_poses(scan.cell, scan.path.T_WS, plan.angles_deg)
    each = np.arange(scan.path.count)
    expected = inverse_kinematics(scan.cell.arm, poses[each, each])[0][:, CONFIGURATION]
    assert np.cos(motion.joints - expected) == pytest.approx(1.0, abs=1e-12)


def test_across_a_pause_the_arm_may_go_to_another_turn(scan: Scan, plan: Plan) -> None:
    assert arm_motion(arm_on_path(scan, CONFIGURATION), plan).step is None
    assert arm_motion(arm_on_path(scan, CONFIGURATION), replace(plan, pauses=())).step is not None


def test_where_the_arm_cannot_follow_the_location_is_told(scan: Scan, plan: Plan) -> None:
    angles = plan.angles_deg.copy()
    angles[50] += 180.0
    assert arm_motion(arm_on_path(scan, CONFIGURATION), replace(plan, angles_deg=angles)).step == 50
