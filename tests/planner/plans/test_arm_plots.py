import numpy as np

from planner.map.config_map import ConfigurationMap
from planner.planning.dynamic_programming import dynamic_programming
from planner.plans.arm_motion import arm_motion
from planner.plans.arm_plots import arm_figure
from planner.plans.plan import Plan
from planner.plans.problem import Problem
from tests.planner.winding_arm import winding_arm


def test_each_joint_has_its_angle_its_speed_and_both_margins() -> None:
    plan = dynamic_programming(Problem(ConfigurationMap(np.ones((12, 36))), step_s=1.0))
    assert isinstance(plan, Plan)
    motion = arm_motion(winding_arm(25.0), plan)
    axes = arm_figure(motion, "title").axes
    assert len(axes) == 12
    for joint in range(6):
        angle, speed = axes[2 * joint], axes[2 * joint + 1]
        assert np.array_equal(angle.lines[0].get_ydata(), np.degrees(motion.joints[:, joint]))
        assert angle.get_title(loc="right") == f"margin {motion.limit_margins_deg[joint]:.1f} deg"
        assert speed.get_title(loc="right") == f"margin {motion.speed_margins_deg_s[joint]:.1f} deg/s"
        lower, upper = angle.get_ylim()
        assert lower < motion.arm.lower_deg[joint] < motion.arm.upper_deg[joint] < upper
