"""The same arm with another counting of its joints: planning and margins must not depend on it."""

from dataclasses import replace

import numpy as np
import pytest

from planner.kinematics.arm import Arm
from planner.map.config_map import ConfigurationMap
from planner.plans.arm_motion import ArmMotion, arm_motion
from planner.plans.arm_on_path import ArmOnPath
from planner.plans.arm_plots import arm_figure
from planner.plans.plan import make_plan
from planner.plans.problem import Problem
from planner.search.joint_turns import Margin, lay_out_turns
from tests.planner.winding_arm import winding_arm

SIGN = np.array([-1.0, 1.0, -1.0, -1.0, 1.0, -1.0])
OFFSET_DEG = np.array([10.0, -20.0, 90.0, 37.0, -5.0, 123.0])


def recounted(arm: Arm) -> Arm:
    """Return the arm with other signs and zeros; a Viper has neither."""
    bounds_deg = np.sort((np.array([arm.lower_deg, arm.upper_deg]) - OFFSET_DEG) * SIGN, axis=0)
    lower_deg, upper_deg = (tuple(row) for row in bounds_deg.tolist())
    return replace(
        arm, lower_deg=lower_deg, upper_deg=upper_deg, sign=tuple(SIGN.tolist()), offset_deg=tuple(OFFSET_DEG.tolist())
    )


@pytest.mark.parametrize(("twist_deg", "start_deg"), [(25.0, 60.0), (-25.0, -60.0)])
def test_joints_margins_turns_and_picture_are_the_robots_own(twist_deg: float, start_deg: float) -> None:
    on_path, count = winding_arm(twist_deg), 25
    other_path = ArmOnPath(recounted(on_path.arm), on_path.solve)
    angles_deg = np.linspace(start_deg, start_deg + 40.0, count)
    problem = Problem(ConfigurationMap(np.ones((count, 36))), 1.0)
    plan = make_plan(problem, "steady", angles_deg, np.zeros(count), np.zeros(count - 1))
    motion, other = arm_motion(on_path, plan), arm_motion(other_path, plan)
    assert motion.step is None
    assert other.step is None
    assert motion.start_turns[5] != 0
    assert np.array_equal(other.start_turns, motion.start_turns * SIGN)
    assert other.robot_deg == pytest.approx((motion.robot_deg - OFFSET_DEG) * SIGN, abs=1e-9)
    assert other.limit_margins_deg == pytest.approx(motion.limit_margins_deg, abs=1e-9)
    assert other.speed_margins_deg_s == pytest.approx(motion.speed_margins_deg_s, abs=1e-9)
    assert_the_picture_shows_the_robots_own_angles(other)


def test_the_turns_of_a_search_are_those_of_the_arm_counted_otherwise() -> None:
    on_path = winding_arm(25.0)
    joints, _ = on_path.solve(np.arange(36), np.arange(0.0, 360.0, 10.0))
    margin = Margin(5.0, 0.95)
    turns = lay_out_turns(on_path.arm, joints, 1.0, margin)
    other = lay_out_turns(recounted(on_path.arm), joints, 1.0, margin)
    assert len(turns.turns) > 1
    assert np.array_equal(other.turns, turns.turns)
    assert np.array_equal(other.after, turns.after)
    for name in ("lower_rad", "upper_rad", "most_rad"):
        assert getattr(other, name) == pytest.approx(getattr(turns, name), abs=1e-12)


def assert_the_picture_shows_the_robots_own_angles(motion: ArmMotion) -> None:
    for joint, axes in enumerate(arm_figure(motion, "title").axes[::2]):
        curve, *limits = axes.lines
        assert np.array_equal(curve.get_ydata(), motion.robot_deg[:, joint])
        bounds_deg = sorted(float(np.asarray(line.get_ydata())[0]) for line in limits)
        assert bounds_deg == pytest.approx([motion.arm.lower_deg[joint], motion.arm.upper_deg[joint]])
