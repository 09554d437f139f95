"""The motion of the arm for a plan of the table, in parts between pauses."""

from dataclasses import dataclass

import numpy as np

from planner.arrays import FloatArray, IndexArray
from planner.kinematics.arm import Arm
from planner.kinematics.joint_path import joint_path, joint_speeds_deg_s
from planner.plans.arm_on_path import ArmOnPath
from planner.plans.plan import Plan
from planner.plans.problem import Problem
from planner.reasons import Reason


@dataclass(frozen=True, eq=False)
class ArmMotion:
    """The joints along a plan.

    Attributes:
        arm: joint limits and joint speeds.
        joints: (n + 1, 6) in radians at each location; rows out of reach are NaN.
        speeds_deg_s: (n + 1, 6) speed of the step to each location; 0 at the start and after a pause.
        start_turns: (6,) whole turns of the robot's own angles at the start, counted from the turn nearest the middle
            of each joint's range.
        reason: REACHED if the arm can follow the plan, else the reason why it cannot.
        step: the first location at which it cannot.
    """

    arm: Arm
    joints: FloatArray
    speeds_deg_s: FloatArray
    start_turns: IndexArray
    reason: Reason = Reason.REACHED
    step: int | None = None

    @property
    def robot_deg(self) -> FloatArray:
        """The (n + 1, 6) joints in the robot's own angles."""
        return self.arm.robot_deg(self.joints)

    @property
    def limit_margins_deg(self) -> FloatArray:
        """The (6,) minimum distances to the nearer joint limit; negative beyond one, NaN where out of reach."""
        joints_deg = self.robot_deg
        above, below = joints_deg - self.arm.lower_deg, np.asarray(self.arm.upper_deg) - joints_deg
        return np.asarray(np.minimum(above, below).min(axis=0))

    @property
    def speed_margins_deg_s(self) -> FloatArray:
        """The (6,) minimum distances to the joint's maximum speed; negative above it, NaN where out of reach."""
        return np.asarray(self.arm.max_speed_deg_s - self.speeds_deg_s.max(axis=0))


def arm_motion(on_path: ArmOnPath, plan: Plan) -> ArmMotion:
    """Return the joints along a plan, and the first location at which the arm cannot follow it.

    In a pause the arm retracts and approaches again, so neither its turns nor its speeds continue across a pause. Of
    the possible turns after it, the nearest is used.
    """
    arm = on_path.arm
    solved, reasons = on_path.solve(np.arange(len(plan.angles_deg)), plan.angles_deg)
    joints, speeds_deg_s = np.empty_like(solved), np.empty_like(solved)
    reason, step = Reason.REACHED, None
    starts = [0, *(pause.step + 1 for pause in plan.pauses)]
    for start, end in zip(starts, [*starts[1:], len(solved)], strict=True):
        before = joints[start - 1] if start else None
        piece = joint_path(arm, solved[start:end], reasons[start:end], plan.step_s, before)
        joints[start:end] = piece.joints
        speeds_deg_s[start:end] = joint_speeds_deg_s(piece.joints, plan.step_s)
        if step is None and piece.step is not None:
            reason, step = piece.reason, start + piece.step
    turns = np.nan_to_num((arm.robot_deg(joints[:1]) - arm.robot_deg(solved[:1]))[0] / 360.0)
    return ArmMotion(arm, joints, speeds_deg_s, np.rint(turns).astype(np.int64), reason, step)


def arm_follows(problem: Problem, plan: Plan) -> bool:
    """Return whether the arm of a problem can follow a plan; without an arm, every plan can be followed."""
    return problem.arm is None or arm_motion(problem.arm, plan).step is None
