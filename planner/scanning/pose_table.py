"""The latched pose of every profile as a table for other programs: CSV, one row a profile.

Frames: B is the robot's base, F its flange. S is the probe: origin at the laser's exit, +Z along the beam, +X along the
laser line. W is the workpiece, which turns with the table. A pose is a position in mm and a unit quaternion with its
scalar last, as scipy and ROS have it.
"""

import csv
import io
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from planner.arrays import FloatArray, IndexArray
from protocol.files.whole_file import write_whole

_POSE = ("x_mm", "y_mm", "z_mm", "qx", "qy", "qz", "qw")
POSE_COLUMNS = (
    "profile",
    "time_s",
    "table_deg",
    *(f"joint_{joint}_deg" for joint in range(1, 7)),
    *(f"BF_{part}" for part in _POSE),
    *(f"WS_{part}" for part in _POSE),
)
"""BF: the flange in the base, from the latched joints. WS: the probe in the workpiece's frame, as the cloud has it."""


def write_poses(
    file: Path,
    numbers: IndexArray,
    times_s: FloatArray,
    angles_deg: FloatArray,
    joints_deg: FloatArray,
    T_BF: FloatArray,
    T_WS: FloatArray,
) -> None:
    """Write the table to `file`, which appears when it is whole.

    Args:
        file: Where.
        numbers: `(n,)` of the profiles, as in the cloud.
        times_s: `(n,)` in the time of the motion.
        angles_deg: `(n,)` latched table angles.
        joints_deg: `(n, 6)` latched joints.
        T_BF: `(n, 4, 4)` flange poses.
        T_WS: `(n, 4, 4)` probe poses.
    """
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(POSE_COLUMNS)
    values = np.column_stack((times_s, angles_deg, joints_deg, _seven(T_BF), _seven(T_WS)))
    # Below a nanometer and a billionth of a radian; adding 0.0 takes the sign of a zero away.
    rows = (np.round(values, 9) + 0.0).tolist()
    for number, row in zip(numbers.tolist(), rows, strict=True):
        table.writerow((number, *(f"{value:.9g}" for value in row)))
    write_whole(file, text.getvalue())


def _seven(T: FloatArray) -> FloatArray:
    """Return position and quaternion `(n, 7)` of poses `(n, 4, 4)`; the scalar is never negative."""
    quaternions = Rotation.from_matrix(T[:, :3, :3]).as_quat(canonical=True) if len(T) else np.empty((0, 4))
    return np.column_stack((T[:, :3, 3], quaternions))
