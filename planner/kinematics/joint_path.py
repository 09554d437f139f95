"""The arm's joints along a path in one configuration: continuous turns, within joint limits and joint speeds."""

from typing import NamedTuple

import numpy as np

from planner.arrays import BoolArray, CodeArray, FloatArray
from planner.kinematics.arm import Arm
from planner.kinematics.wrist_turn import turns_the_long_way
from planner.reasons import Reason

_TURN = 2.0 * np.pi


class JointPath(NamedTuple):
    """The joints along a path, or the reason why the arm cannot follow it.

    Attributes:
        joints: `(n, 6)` in radians; rows out of reach are NaN.
        reason: REACHED if the arm can follow the path, else the reason why it cannot.
        step: the first step at which it cannot, from 0.
    """

    joints: FloatArray
    reason: Reason
    step: int | None


def joint_path(
    arm: Arm, joints: FloatArray, reasons: CodeArray, step_s: float, before: FloatArray | None = None
) -> JointPath:
    """Return the joints on continuous turns, within the limits of the arm if possible.

    Each step uses the turn nearest to the previous one; between two steps the joints move proportionally. The turn at
    the start is free (joints 4 and 6 have several). Several turns may keep the whole path within the limits of a joint.
    Then the path nearest to the middle of its range is used, or nearest to `before`. If there is none, the one that
    follows the path farthest is used.

    Args:
        arm: joint limits and speeds.
        joints: `(n, 6)` in radians, on any turn; one row every `step_s`.
        reasons: `(n,)` of the inverse kinematics.
        step_s: time from one row to the next.
        before: `(6,)` in radians, the joints before the start of the path.
    """
    unsolved = np.flatnonzero(np.isin(reasons, (Reason.OUT_OF_REACH, Reason.SINGULAR)))
    if len(unsolved):
        return JointPath(joints, Reason(int(reasons[unsolved[0]])), int(unsolved[0]))

    lower, upper = arm.limits
    joints = np.unwrap(joints, axis=0)
    joints = joints + _start_turns(joints, lower, upper, before)
    beyond = (joints < lower) | (joints > upper)
    too_fast = joint_speeds_deg_s(joints, step_s) > arm.max_speed_deg_s
    spins = _flange_spins(joints)
    faulty = np.flatnonzero((beyond | too_fast).any(axis=1) | spins)
    if not len(faulty):
        return JointPath(joints, Reason.REACHED, None)
    step = int(faulty[0])
    if spins[step]:
        return JointPath(joints, Reason.WRIST_TURN, step)
    first, faults = (Reason.JOINT_1_LIMIT, beyond) if beyond[step].any() else (Reason.JOINT_1_SPEED, too_fast)
    return JointPath(joints, Reason(first + int(np.argmax(faults[step]))), step)


def joint_speeds_deg_s(joints: FloatArray, step_s: float) -> FloatArray:
    """Return the speeds `(n, 6)` of the steps to each row of joints `(n, 6)`, in radians; 0 in the first row."""
    return np.asarray(np.degrees(np.abs(np.diff(joints, axis=0, prepend=joints[:1]))) / step_s)


def _flange_spins(joints: FloatArray) -> BoolArray:
    """Return whether the flange takes the longer direction to each row (n,) of joints (n, 6)."""
    moves = np.diff(joints, axis=0)
    ways = zip(joints[:-1, 4].tolist(), joints[1:, 4].tolist(), moves[:, 3].tolist(), moves[:, 5].tolist(), strict=True)
    return np.array([False, *(turns_the_long_way(*way) for way in ways)])


def _start_turns(joints: FloatArray, lower: FloatArray, upper: FloatArray, before: FloatArray | None) -> FloatArray:
    """Return the offset of each joint, `(6,)`: whole turns, in radians."""
    lowest, highest = np.minimum.accumulate(joints), np.maximum.accumulate(joints)
    # For each start of the path, the turn that fits, if any.
    central = -_TURN * np.rint((0.5 * (lowest + highest) - 0.5 * (lower + upper)) / _TURN)
    fits = (lowest + central >= lower) & (highest + central <= upper)
    last = np.where(fits[-1], len(joints), np.argmin(fits, axis=0)) - 1
    each = np.arange(joints.shape[1])
    chosen = central[np.maximum(last, 0), each]
    if before is None:
        return np.asarray(chosen)
    near = _TURN * np.rint((before - joints[0]) / _TURN)
    least = _TURN * np.ceil((lower - lowest[-1]) / _TURN)
    most = _TURN * np.floor((upper - highest[-1]) / _TURN)
    return np.asarray(np.where(fits[-1], np.clip(near, np.minimum(least, chosen), np.maximum(most, chosen)), chosen))
