"""The arm along a scan path in one configuration: its joints at any location and table angle."""

from collections.abc import Callable
from dataclasses import dataclass

from planner.arrays import CodeArray, FloatArray, IndexArray
from planner.cell.cell import Cell
from planner.cell.scan import Scan
from planner.kinematics.arm import Arm
from planner.kinematics.configuration import Configuration
from planner.kinematics.inverse_kinematics import inverse_kinematics


@dataclass(frozen=True, eq=False)
class ArmOnPath:
    """The arm data for planning.

    Attributes:
        arm: joint limits and joint speeds.
        solve: from scan locations (m,) and table angles (m,) in degrees to the joints (m, 6) in radians, and the
            reasons (m,) of the inverse kinematics. Each joint is on the turn nearest to the middle of its range.
    """

    arm: Arm
    solve: Callable[[IndexArray, FloatArray], tuple[FloatArray, CodeArray]]


def arm_on_path(scan: Scan, configuration: Configuration) -> ArmOnPath:
    """Return the arm of a scan in one configuration."""
    return arm_along(scan.cell, scan.path.T_WS, configuration)


def arm_along(cell: Cell, T_WS: FloatArray, configuration: Configuration) -> ArmOnPath:
    """Return the arm of a cell along scan locations `(n, 4, 4)` in one configuration."""
    T_TF = cell.location_factors(T_WS)

    def solve(locations: IndexArray, angles_deg: FloatArray) -> tuple[FloatArray, CodeArray]:
        joints, reasons = inverse_kinematics(cell.arm, cell.table_factors(angles_deg) @ T_TF[locations])
        return joints[:, configuration], reasons[:, configuration]

    return ArmOnPath(cell.arm, solve)
