"""Closed-form inverse kinematics of an ortho-parallel arm with a spherical wrist: all eight configurations.

The wrist center determines joints 1 to 3; then the orientation of the flange determines joints 4 to 6. There are two
choices for joint 1 (LEFTY faces the wrist, RIGHTY has its back to it), two for the elbow and two for the wrist.
Together they give the eight solutions.

For speed, common values of the configurations are computed once. Sines and cosines are computed from the sides of the
triangle instead of its angles. `inverse` is one long function, because each call passes every array again, which costs
a fifth of the time.
"""

import math

import numpy as np

from planner.arrays import CodeArray, FloatArray
from planner.kernel import kernel
from planner.kinematics.arm import A_MM, D_MM, LOWER_RAD, SIN_ALPHA, UPPER_RAD, Arm
from planner.reasons import Reason

_REACHED = int(Reason.REACHED)
_OUT_OF_REACH = int(Reason.OUT_OF_REACH)
_SINGULAR = int(Reason.SINGULAR)
_JOINT_1_LIMIT = int(Reason.JOINT_1_LIMIT)

_TURN = 2.0 * math.pi
_TURNS_PER_RAD = 1.0 / _TURN
# Below these values, only rounding determines the angle of the joint that is undefined in the singularity.
_SINGULAR_SINE = 1e-9
_SINGULAR_DISTANCE2_MM2 = 1e-18


def inverse_kinematics(arm: Arm, T_BF: FloatArray) -> tuple[FloatArray, CodeArray]:
    """Return the joints `(n, 8, 6)` in radians and the reasons `(n, 8)` for flange poses `(n, 4, 4)` in mm.

    The second axis is the slot of the `Configuration`. Each joint is on the turn nearest the middle of its range. So if
    it exceeds a limit there, it exceeds it on every turn. Out of reach, the joints are NaN; beyond a limit they are
    returned nevertheless. In a singularity, the free joint (1 or 4) is set to the middle of its range, the others
    complete the pose, and the reason is SINGULAR: that solution is one of infinitely many.
    """
    poses = np.ascontiguousarray(T_BF, dtype=np.float64)
    joints = np.empty((len(poses), 8, 6))
    reasons = np.empty((len(poses), 8), dtype=np.uint8)
    _inverse_of_each(arm.table, poses, joints, reasons)
    return joints, reasons


@kernel
def _middle(arm: FloatArray, j: int) -> float:
    middle: float = 0.5 * (arm[j, LOWER_RAD] + arm[j, UPPER_RAD])
    return middle


@kernel
def _nearest_turn(arm: FloatArray, j: int, angle: float) -> float:
    """Return the angle on the turn nearest the middle of the range of joint j + 1."""
    turns: float = np.rint((angle - _middle(arm, j)) * _TURNS_PER_RAD)
    return angle - _TURN * turns


@kernel
def _first_limit(arm: FloatArray, joints: FloatArray, slot: int) -> int:
    for j in range(6):
        if not arm[j, LOWER_RAD] <= joints[slot, j] <= arm[j, UPPER_RAD]:
            return _JOINT_1_LIMIT + j
    return _REACHED


@kernel
def _solve_wrist(
    arm: FloatArray,
    T_BF: FloatArray,
    c1: float,
    s1: float,
    c23: float,
    s23: float,
    joints: FloatArray,
    slot: int,
) -> bool:
    """Write joints 4 to 6 of FLIP to `slot` and of NOFLIP to `slot + 1`; return whether axes 4 and 6 coincide.

    Base and forearm differ by Rz(joint 1) Ry(joints 2 + 3). In the forearm's frame, the wrist rotates the flange by R =
    Rz(joint 4) Ry(joint 5) Rz(joint 6).
    """
    u0 = c1 * T_BF[0, 0] + s1 * T_BF[1, 0]
    u1 = c1 * T_BF[0, 1] + s1 * T_BF[1, 1]
    u2 = c1 * T_BF[0, 2] + s1 * T_BF[1, 2]
    r00, r01, r02 = c23 * u0 - s23 * T_BF[2, 0], c23 * u1 - s23 * T_BF[2, 1], c23 * u2 - s23 * T_BF[2, 2]
    r10 = c1 * T_BF[1, 0] - s1 * T_BF[0, 0]
    r11 = c1 * T_BF[1, 1] - s1 * T_BF[0, 1]
    r12 = c1 * T_BF[1, 2] - s1 * T_BF[0, 2]
    r22 = s23 * u2 + c23 * T_BF[2, 2]
    sine = math.sqrt(r02 * r02 + r12 * r12)
    aligned = sine < _SINGULAR_SINE
    if aligned:
        joint_4 = _middle(arm, 3)
        c4, s4 = math.cos(joint_4), math.sin(joint_4)
    else:
        sense = -arm[3, SIN_ALPHA]
        c4, s4 = sense * r02 / sine, sense * r12 / sine
        joint_4 = math.atan2(s4, c4)
    joint_5 = math.atan2(sine, r22)
    # From Rz(-joint 4) R, which is valid for any joint 4, so it completes the pose in the singularity too.
    joint_6 = math.atan2(c4 * r10 - s4 * r00, c4 * r11 - s4 * r01)
    joints[slot, 3] = _nearest_turn(arm, 3, joint_4 + math.pi)
    joints[slot, 4] = _nearest_turn(arm, 4, -joint_5)
    joints[slot, 5] = _nearest_turn(arm, 5, joint_6 + math.pi)
    joints[slot + 1, 3] = _nearest_turn(arm, 3, joint_4)
    joints[slot + 1, 4] = _nearest_turn(arm, 4, joint_5)
    joints[slot + 1, 5] = _nearest_turn(arm, 5, joint_6)
    return aligned


@kernel
def _mark_out_of_reach(joints: FloatArray, reasons: CodeArray, first: int, last: int) -> None:
    for slot in range(first, last):
        reasons[slot] = _OUT_OF_REACH
        for j in range(6):
            joints[slot, j] = math.nan


@kernel
def inverse(arm: FloatArray, T_BF: FloatArray, joints: FloatArray, reasons: CodeArray) -> None:
    """Write the eight solutions of one pose; see `inverse_kinematics`.

    Args:
        arm: table of the arm, `(6, 6)`.
        T_BF: flange pose `(4, 4)` or `(3, 4)`, in mm.
        joints: output `(8, 6)`, radians.
        reasons: output `(8,)`.
    """
    d1, d4, d6 = arm[0, D_MM], arm[3, D_MM], arm[5, D_MM]
    a1, a2, a3 = arm[0, A_MM], arm[1, A_MM], arm[2, A_MM]
    # With all twists negated, joints 2, 3 and 5 have the opposite direction, and nothing else changes.
    sense = -arm[0, SIN_ALPHA]
    # The wrist center is in the plane that joint 1 turns, which passes axis 1 at the distance `lateral`.
    x = T_BF[0, 3] - d6 * T_BF[0, 2]
    y = T_BF[1, 3] - d6 * T_BF[1, 2]
    drop = d1 - (T_BF[2, 3] - d6 * T_BF[2, 2])
    lateral = sense * (arm[1, D_MM] + arm[2, D_MM])
    distance2 = x * x + y * y
    in_plane2 = distance2 - lateral * lateral
    if not in_plane2 >= 0.0:
        _mark_out_of_reach(joints, reasons, 0, 8)
        return
    in_plane = math.sqrt(in_plane2)
    on_axis_1 = distance2 < _SINGULAR_DISTANCE2_MM2
    azimuth, shoulder = math.atan2(y, x), math.atan2(lateral, in_plane)
    forearm2 = a3 * a3 + d4 * d4
    forearm, stretched = math.sqrt(forearm2), math.atan2(d4, a3)

    for side in (0, 4):  # the first slot of LEFTY, and of RIGHTY
        facing = azimuth - shoulder if side == 0 else azimuth + shoulder + math.pi
        joint_1 = _middle(arm, 0) if on_axis_1 else _nearest_turn(arm, 0, facing)
        c1, s1 = math.cos(joint_1), math.sin(joint_1)
        # The triangle of upper arm, forearm and the distance from joint 2 to the wrist center, `ahead` of it and below.
        ahead = (in_plane if side == 0 else -in_plane) - a1
        span2 = ahead * ahead + drop * drop
        cos_elbow = (span2 - a2 * a2 - forearm2) / (2.0 * a2 * forearm)
        if not -1.0 <= cos_elbow <= 1.0:
            _mark_out_of_reach(joints, reasons, side, side + 4)
            continue
        elbow, along = math.acos(cos_elbow), a2 + forearm * cos_elbow
        across = forearm * math.sqrt((1.0 - cos_elbow) * (1.0 + cos_elbow))
        to_wrist, off_wrist = math.atan2(drop, ahead), math.atan2(across, along)
        singular = on_axis_1 or span2 < _SINGULAR_DISTANCE2_MM2
        for below in (0, 2):
            slot = side + below
            # The forearm bends down from the upper arm for LEFTY ABOVE and RIGHTY BELOW.
            bend = 1.0 if (side == 0) == (below == 0) else -1.0
            joint_2 = _nearest_turn(arm, 1, sense * (to_wrist - bend * off_wrist))
            joint_3 = _nearest_turn(arm, 2, sense * (bend * elbow + stretched))
            forearm_ahead = ahead - a2 * (ahead * along + bend * drop * across) / span2
            forearm_drop = drop - a2 * (drop * along - bend * ahead * across) / span2
            c23 = (a3 * forearm_ahead - d4 * forearm_drop) / forearm2
            s23 = (a3 * forearm_drop + d4 * forearm_ahead) / forearm2
            aligned = _solve_wrist(arm, T_BF, c1, s1, c23, s23, joints, slot)
            for solution in (slot, slot + 1):
                joints[solution, 0], joints[solution, 1], joints[solution, 2] = joint_1, joint_2, joint_3
                reasons[solution] = _SINGULAR if singular or aligned else _first_limit(arm, joints, solution)


@kernel
def _inverse_of_each(arm: FloatArray, poses: FloatArray, joints: FloatArray, reasons: CodeArray) -> None:
    for i in range(len(poses)):
        inverse(arm, poses[i], joints[i], reasons[i])
