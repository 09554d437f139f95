"""The arm's joints along a plan: one configuration, continuous turns, within joint limits and speeds."""

from typing import NamedTuple

import numpy as np

from planner.arrays import FloatArray
from planner.kinematics.arm import Arm
from planner.kinematics.configuration import Configuration
from planner.kinematics.inverse_kinematics import inverse_kinematics
from planner.reasons import Reason

_TURN = 2.0 * np.pi


class JointPath(NamedTuple):
    """The joints along a path, or why the arm cannot follow it.

    Attributes:
        joints: `(n, 6)` in radians; rows out of reach are NaN.
        reason: REACHED when the arm can follow the path, else why it cannot.
        step: The first step at which it cannot, counted from 0.
    """

    joints: FloatArray
    reason: Reason
    step: int | None


def joint_path(arm: Arm, configuration: Configuration, T_BF: FloatArray, step_s: float) -> JointPath:
    """Return the joints in one configuration along flange poses `(n, 4, 4)`, one every `step_s`.

    Each step takes the turn nearest the one before. Which turn the path starts on is free (joints 4 and 6 have more
    than one), so each joint's whole path lies on the turn that brings it nearest the middle of its range.
    """
    solutions, reasons = inverse_kinematics(arm, T_BF)
    joints, reason = solutions[:, configuration], reasons[:, configuration]
    unsolved = np.flatnonzero(np.isin(reason, (Reason.OUT_OF_REACH, Reason.SINGULAR)))
    if len(unsolved):
        return JointPath(joints, Reason(int(reason[unsolved[0]])), int(unsolved[0]))

    lower, upper = arm.limits
    joints = np.unwrap(joints, axis=0)
    off_middle = 0.5 * (joints.min(axis=0) + joints.max(axis=0)) - 0.5 * (lower + upper)
    joints -= _TURN * np.rint(off_middle / _TURN)

    beyond = (joints < lower) | (joints > upper)
    speeds_deg_s = np.degrees(np.abs(np.diff(joints, axis=0, prepend=joints[:1]))) / step_s
    too_fast = speeds_deg_s > arm.max_speed_deg_s
    faulty = np.flatnonzero((beyond | too_fast).any(axis=1))
    if not len(faulty):
        return JointPath(joints, Reason.REACHED, None)
    step = int(faulty[0])
    first, faults = (Reason.JOINT_1_LIMIT, beyond) if beyond[step].any() else (Reason.JOINT_1_SPEED, too_fast)
    return JointPath(joints, Reason(first + int(np.argmax(faults[step]))), step)
