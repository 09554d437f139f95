from dataclasses import replace

import numpy as np
import pytest

from planner.arrays import FloatArray
from planner.kinematics.arm import Arm
from planner.kinematics.configuration import Configuration
from planner.kinematics.joint_path import joint_path
from planner.reasons import Reason

VIPER = Arm.load()
HOME_DEG = np.array([10.0, -60.0, 150.0, 20.0, 40.0, 30.0])


def sweep(joint: int, from_deg: float, to_deg: float, count: int = 50) -> FloatArray:
    """Return joints in radians that stay at home but for one joint, counted from 1."""
    joints_deg = np.tile(HOME_DEG, (count, 1))
    joints_deg[:, joint - 1] = np.linspace(from_deg, to_deg, count)
    return np.asarray(np.radians(joints_deg))


@pytest.mark.parametrize(
    ("joint", "from_deg", "to_deg"), [(4, -185.0, 185.0), (6, -350.0, 350.0), (6, 170.0, 355.0), (1, -160.0, 160.0)]
)
def test_the_path_is_continuous_over_the_turns_of_a_joint(joint: int, from_deg: float, to_deg: float) -> None:
    joints = sweep(joint, from_deg, to_deg)
    result = joint_path(VIPER, Configuration.LEFTY_ABOVE_NOFLIP, VIPER.flange_poses(joints), step_s=0.5)
    assert (result.reason, result.step) == (Reason.REACHED, None)
    moved = np.degrees(result.joints - result.joints[0])
    np.testing.assert_allclose(moved, np.degrees(joints - joints[0]), atol=1e-6)
    assert (np.degrees(result.joints) <= VIPER.upper_deg).all()
    assert (np.degrees(result.joints) >= VIPER.lower_deg).all()


def test_more_turns_than_a_joint_has_end_at_its_limit() -> None:
    poses = VIPER.flange_poses(sweep(6, -400.0, 400.0))
    result = joint_path(VIPER, Configuration.LEFTY_ABOVE_NOFLIP, poses, step_s=0.5)
    assert result.reason == Reason.JOINT_6_LIMIT
    assert result.step == 0


@pytest.mark.parametrize(("step_s", "reason"), [(0.034, Reason.REACHED), (0.032, Reason.JOINT_6_SPEED)])
def test_a_joint_may_not_move_faster_than_it_can(step_s: float, reason: Reason) -> None:
    # 20 degrees a step at 600 deg/s take 0.0333 s.
    poses = VIPER.flange_poses(sweep(6, 0.0, 200.0, count=11))
    result = joint_path(VIPER, Configuration.LEFTY_ABOVE_NOFLIP, poses, step_s)
    assert result.reason == reason
    assert result.step == (None if reason == Reason.REACHED else 1)


def test_a_step_out_of_reach_is_named() -> None:
    poses = VIPER.flange_poses(sweep(1, 0.0, 10.0, count=5))
    poses[3, 0, 3] += 1000.0
    result = joint_path(VIPER, Configuration.LEFTY_ABOVE_NOFLIP, poses, step_s=0.5)
    assert (result.reason, result.step) == (Reason.OUT_OF_REACH, 3)


def test_the_first_step_beyond_a_limit_is_named() -> None:
    joints = sweep(2, -100.0, 0.0, count=11)
    narrow = replace(VIPER, upper_deg=(170.0, -35.0, 256.0, 190.0, 120.0, 360.0))
    result = joint_path(narrow, Configuration.LEFTY_ABOVE_NOFLIP, VIPER.flange_poses(joints), step_s=1.0)
    assert (result.reason, result.step) == (Reason.JOINT_2_LIMIT, 7)
