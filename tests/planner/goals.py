"""The poses of the flange that put the probe on the locations of a path."""

import numpy as np

from planner.arrays import FloatArray
from planner.cell.cell import Cell


def goal_flange_poses(cell: Cell, T_WS: FloatArray, angles_deg: FloatArray) -> FloatArray:
    """Return T_BF = T_BT Rz(theta) T_TW T_L inv(T_FS) `(n, m, 4, 4)` for n locations and m table angles."""
    return cell.table_factors(angles_deg)[np.newaxis] @ cell.location_factors(T_WS)[:, np.newaxis]
