"""Determine an arm's configuration from its joints."""

import math

import numpy as np

from planner.arrays import FloatArray, IndexArray
from planner.kinematics.arm import Arm


def configurations(arm: Arm, joints: FloatArray) -> IndexArray:
    """Return the slot `(n,)` of the configuration of each row of joints `(n, 6)`, in radians.

    LEFTY: the wrist center is ahead of axis 1. ABOVE: the elbow bends down from the stretched arm (up for RIGHTY).
    FLIP: joint 5 is negative. At a boundary between two configurations, LEFTY and NOFLIP are returned.
    """
    # Mirrored twists reverse the direction of joints 2 and 3.
    sense = -math.copysign(1.0, arm.alpha_deg[0])
    upper, forearm = sense * joints[:, 1], sense * (joints[:, 1] + joints[:, 2])
    reach_mm = arm.a_mm[0] + arm.a_mm[1] * np.cos(upper) + arm.a_mm[2] * np.cos(forearm) + arm.d_mm[3] * np.sin(forearm)
    stretched = math.atan2(arm.d_mm[3], arm.a_mm[2])
    elbow_bends_down = np.sin(sense * joints[:, 2] - stretched) > 0.0
    righty = reach_mm < 0.0
    below = elbow_bends_down == righty
    noflip = np.sin(joints[:, 4]) >= 0.0
    return np.asarray(4 * righty + 2 * below + noflip, dtype=np.int64)
