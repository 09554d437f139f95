"""Transform profiles into the workpiece's frame, from the robot's pose and the table's angle latched at their trigger.

T_WS = inv(T_TW) Rz(-theta) inv(T_BT) T_BF T_FS. The robot carries the probe (S) on its flange (F), and the table (T)
turns the workpiece (W). Both are in the robot's base frame (B).
"""

from dataclasses import dataclass

import numpy as np

from planner.arrays import FloatArray, IndexArray
from planner.cell.cell import Cell
from planner.geometry.transforms import rigid_inverse, rotations_z


@dataclass(frozen=True, eq=False)
class Calibration:
    """The placements for the alignment of a profile; each is a rigid `(4, 4)` in mm.

    Attributes:
        T_FS: pose of the probe on the flange.
        T_BT: pose of the table in the robot's base: its z axis is the axis of rotation.
        T_TW: pose of the workpiece on the table, at table angle 0.
    """

    T_FS: FloatArray
    T_BT: FloatArray
    T_TW: FloatArray

    @classmethod
    def of(cls, cell: Cell) -> "Calibration":
        """Return the placements of the cell's description."""
        return cls(cell.T_FS, cell.T_BT, cell.T_TW)


def probe_poses(calibration: Calibration, T_BF: FloatArray, angles_deg: FloatArray) -> FloatArray:
    """Return the probe in the workpiece's frame, T_WS `(n, 4, 4)`.

    Args:
        calibration: the placements.
        T_BF: latched flange poses, `(n, 4, 4)`.
        angles_deg: table angles latched at the same triggers, `(n,)`.
    """
    T_WB = rigid_inverse(calibration.T_TW) @ rotations_z(-angles_deg) @ rigid_inverse(calibration.T_BT)
    return np.asarray(T_WB @ T_BF @ calibration.T_FS)


def aligned(T_WS: FloatArray, profiles: IndexArray, points_S: FloatArray) -> FloatArray:
    """Return points `(m, 3)` in frame W, each transformed from frame S by the pose of its profile.

    Args:
        T_WS: `(n, 4, 4)`.
        profiles: `(m,)` pose index of each point.
        points_S: `(m, 3)` in mm.
    """
    turned = np.einsum("ijk,ik->ij", T_WS[profiles, :3, :3], points_S)
    return np.asarray(turned + T_WS[profiles, :3, 3])
