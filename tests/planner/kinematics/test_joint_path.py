from dataclasses import replace

import numpy as np
import pytest

from planner.arrays import FloatArray
from planner.kinematics.arm import Arm
from planner.kinematics.configuration import Configuration
from planner.kinematics.inverse_kinematics import inverse_kinematics
from planner.kinematics.joint_path import JointPath, joint_path
from planner.reasons import Reason

VIPER = Arm.load()
HOME_DEG = np.array([10.0, -60.0, 150.0, 20.0, 40.0, 30.0])


def sweep(joint: int, from_deg: float, to_deg: float, count: int = 50) -> FloatArray:
    """Return joints in radians at home except for one joint, counted from 1."""
    joints_deg = np.tile(HOME_DEG, (count, 1))
    joints_deg[:, joint - 1] = np.linspace(from_deg, to_deg, count)
    return np.asarray(np.radians(joints_deg))


def path_through(arm: Arm, poses: FloatArray, step_s: float, before_deg: FloatArray | None = None) -> JointPath:
    joints, reasons = inverse_kinematics(arm, poses)
    slot = Configuration.LEFTY_ABOVE_NOFLIP
    before = None if before_deg is None else np.radians(before_deg)
    return joint_path(arm, joints[:, slot], reasons[:, slot], step_s, before)


@pytest.mark.parametrize(
    ("joint", "from_deg", "to_deg"), [(4, -185.0, 185.0), (6, -350.0, 350.0), (6, 170.0, 355.0), (1, -160.0, 160.0)]
)
def test_the_path_is_continuous_over_the_turns_of_a_joint(joint: int, from_deg: float, to_deg: float) -> None:
    joints = sweep(joint, from_deg, to_deg)
    result = path_through(VIPER, VIPER.flange_poses(joints), 0.5)
    assert (result.reason, result.step) == (Reason.REACHED, None)
    moved = np.degrees(result.joints - result.joints[0])
    np.testing.assert_allclose(moved, np.degrees(joints - joints[0]), atol=1e-6)
    assert (np.degrees(result.joints) <= VIPER.upper_deg).all()
    assert (np.degrees(result.joints) >= VIPER.lower_deg).all()


@pytest.mark.parametrize(("from_deg", "step"), [(-400.0, 25), (-300.0, 41)])
def test_more_turns_than_a_joint_has_start_on_the_turn_that_goes_farthest(from_deg: float, step: int) -> None:
    # 801 degrees in 49 steps of 16.3. From -400, which is -40 a turn farther, the limit is 400 degrees away.
    poses = VIPER.flange_poses(sweep(6, from_deg, from_deg + 801.0))
    result = path_through(VIPER, poses, 0.5)
    assert (result.reason, result.step) == (Reason.JOINT_6_LIMIT, step)
    assert (np.degrees(result.joints[:step, 5]) <= 360.0).all()
    assert (np.degrees(result.joints[:step, 5]) >= -360.0).all()


@pytest.mark.parametrize(
    ("before_deg", "first_deg"), [(None, -10.0), (340.0, 350.0), (-340.0, -370.0 + 360.0), (800.0, 350.0)]
)
def test_after_a_pause_the_nearest_turn_that_serves_is_taken(before_deg: float | None, first_deg: float) -> None:
    # From -10 down to -200: -370 would be beyond the limit, 350 would not.
    poses = VIPER.flange_poses(sweep(6, -10.0, -200.0))
    before = None if before_deg is None else np.array([0.0, 0.0, 0.0, 0.0, 0.0, before_deg])
    result = path_through(VIPER, poses, 0.5, before)
    assert np.degrees(result.joints[0, 5]) == pytest.approx(first_deg)
    assert result.step is None


@pytest.mark.parametrize(("step_s", "reason"), [(0.034, Reason.REACHED), (0.032, Reason.JOINT_6_SPEED)])
def test_a_joint_may_not_move_faster_than_it_can(step_s: float, reason: Reason) -> None:
    # 20 degrees a step at 600 deg/s take 0.0333 s.
    poses = VIPER.flange_poses(sweep(6, 0.0, 200.0, count=11))
    result = path_through(VIPER, poses, step_s)
    assert result.reason == reason
    assert result.step == (None if reason == Reason.REACHED else 1)


def test_a_step_out_of_reach_is_named() -> None:
    poses = VIPER.flange_poses(sweep(1, 0.0, 10.0, count=5))
    poses[3, 0, 3] += 1000.0
    result = path_through(VIPER, poses, 0.5)
    assert (result.reason, result.step) == (Reason.OUT_OF_REACH, 3)


def test_the_first_step_beyond_a_limit_is_named() -> None:
    joints = sweep(2, -100.0, 0.0, count=11)
    narrow = replace(VIPER, upper_deg=(170.0, -35.0, 256.0, 190.0, 120.0, 360.0))
    result = path_through(narrow, VIPER.flange_poses(joints), 1.0)
    assert (result.reason, result.step) == (Reason.JOINT_2_LIMIT, 7)


def test_a_swing_of_the_wrist_whose_nearest_turns_spin_the_flange_is_refused() -> None:
    joints = np.radians(np.tile(HOME_DEG, (4, 1)))
    joints[:, 4] = np.radians(6.0)
    # Joint 6 moves by -195 degrees against joint 4; the nearest turn is 165, in the same direction.
    joints[2:, 3] += np.radians(165.0)
    joints[2:, 5] -= np.radians(195.0)
    result = path_through(VIPER, VIPER.flange_poses(joints), 1.0)
    assert (result.reason, result.step) == (Reason.WRIST_TURN, 2)
