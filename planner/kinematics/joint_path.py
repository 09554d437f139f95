"""The arm's joints along a path in one configuration: continuous turns, within joint limits and joint speeds."""

from typing import NamedTuple

import numpy as np

from planner.arrays import BoolArray, CodeArray, FloatArray
from planner.kinematics.arm import Arm
from planner.kinematics.wrist_turn import turns_the_long_way
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


def joint_path(
    arm: Arm, joints: FloatArray, reasons: CodeArray, step_s: float, before: FloatArray | None = None
) -> JointPath:
    """Return the joints on continuous turns, within the limits of the arm where possible.

    Each step takes the turn nearest the one before; between two steps the joints move in proportion. The turn at the
    start is free (joints 4 and 6 have more than one). Of the turns that keep the whole path within a joint's limits,
    the one is taken that brings the path nearest the middle of its range, or nearest `before`. Where no turn does, the
    one that follows the path farthest.

    Args:
        arm: Joint limits and speeds.
        joints: `(n, 6)` in radians, on any turn; one row every `step_s`.
        reasons: `(n,)` of the inverse kinematics.
        step_s: Time from one row to the next.
        before: `(6,)` in radians, the joints before the path begins.
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
    """Return the speeds `(n, 6)` at which joints `(n, 6)`, in radians, are reached; 0 in the first row."""
    return np.asarray(np.degrees(np.abs(np.diff(joints, axis=0, prepend=joints[:1]))) / step_s)


def _flange_spins(joints: FloatArray) -> BoolArray:
    """Return whether the flange goes the longer way round to each row (n,) of joints (n, 6)."""
    moves = np.diff(joints, axis=0)
    ways = zip(joints[:-1, 4].tolist(), joints[1:, 4].tolist(), moves[:, 3].tolist(), moves[:, 5].tolist(), strict=True)
    return np.array([False, *(turns_the_long_way(*way) for way in ways)])


def _start_turns(joints: FloatArray, lower: FloatArray, upper: FloatArray, before: FloatArray | None) -> FloatArray:
    """Return what to add to each joint, `(6,)`: whole turns, in radians."""
    lowest, highest = np.minimum.accumulate(joints), np.maximum.accumulate(joints)
    # For each beginning of the path, the turn that fits if any does.
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
