"""Poses of the flange that put the probe on the locations of a path, and poses as rows of numbers."""

import numpy as np

from planner.arrays import FloatArray
from planner.cell.cell import Cell


def goal_flange_poses(cell: Cell, T_WS: FloatArray, angles_deg: FloatArray) -> FloatArray:
    """Return T_BF = T_BT Rz(theta) T_TW T_L inv(T_FS) `(n, m, 4, 4)` for n locations and m table angles."""
    return cell.table_factors(angles_deg)[np.newaxis] @ cell.location_factors(T_WS)[:, np.newaxis]


def to_xyz_yaw_pitch_roll(T: FloatArray) -> FloatArray:
    """Return rows x y z (mm) yaw pitch roll (deg) `(n, 6)` for `(n, 4, 4)`.

    Pitch is in 0..180. At pitch 0 and 180 yaw and roll turn about the same axis, and yaw is 0.
    """
    sine = np.hypot(T[:, 0, 2], T[:, 1, 2])
    yaw = np.where(sine > 1e-12, np.arctan2(T[:, 1, 2], T[:, 0, 2]), 0.0)
    pitch = np.arctan2(sine, T[:, 2, 2])
    c, s = np.cos(yaw), np.sin(yaw)
    roll = np.arctan2(c * T[:, 1, 0] - s * T[:, 0, 0], c * T[:, 1, 1] - s * T[:, 0, 1])
    return np.column_stack((T[:, :3, 3], np.degrees(np.column_stack((yaw, pitch, roll)))))
