"""The scanning cell: the frames, their placements, and the arm's goal for every location and table angle.

Frames: B is the base of the arm. T is the table, with its origin in the middle of its top, and z along its axis. W is
the workpiece, which turns with the table. F is the flange. S is the sensor, that is, the probe. Its origin is at the
laser's exit, +Z along the beam, +X along the laser line, +Y in the scan direction. Placements are rigid
transformations: `T_BT` is the pose of T in B.
"""

from dataclasses import dataclass, field

import numpy as np

from planner.arrays import FloatArray
from planner.errors import PoseError
from planner.geometry.transforms import first_not_rigid, from_xyz_yaw_pitch_roll, rigid_inverse, rotations_z
from planner.kinematics.arm import Arm


@dataclass(frozen=True)
class Table:
    """The rotary table: a disc below the plane z = 0 of frame T, on a base that stands on the floor z = 0 of B."""

    radius_mm: float = 250.0
    thickness_mm: float = 20.0
    plinth_radius_mm: float = 120.0


@dataclass(frozen=True)
class Probe:
    """The laser probe in the planner: one laser line, a measuring range, a housing.

    The paper does not name a product. Range and line are those of a typical short-range triangulation probe. The
    housing is an estimate.

    Attributes:
        stand_off_mm: distance from the laser's exit to the surface, in the middle of the measuring range.
        nearest_mm: start of the measuring range.
        farthest_mm: end of the measuring range.
        line_width_mm: width of the laser line at the stand-off.
        body_mm: size of the housing along X, Y and Z of frame S; it ends at the laser's exit plane z = 0.
    """

    stand_off_mm: float = 150.0
    nearest_mm: float = 100.0
    farthest_mm: float = 200.0
    line_width_mm: float = 60.0
    body_mm: tuple[float, float, float] = (50.0, 150.0, 80.0)


def placement(*x_y_z_yaw_pitch_roll: float) -> FloatArray:
    """Return the matrix `(4, 4)` of a pose given as six numbers of the robot language, in mm and degrees."""
    return np.asarray(from_xyz_yaw_pitch_roll(np.array([x_y_z_yaw_pitch_roll]))[0])


@dataclass(frozen=True, eq=False)
class Cell:
    """Arm, table and probe with their placements. The defaults are estimates of a cell like the paper's.

    Attributes:
        arm: the arm; B has its origin at the foot of the arm.
        T_BT: pose of the table in the base.
        T_TW: pose of the workpiece on the table, at table angle 0.
        T_FS: pose of the probe on the flange.
        table: shape of the table.
        probe: shape and measuring range of the probe.

    Raises:
        PoseError: a placement is not a rigid transformation.
    """

    arm: Arm = field(default_factory=Arm.load)
    T_BT: FloatArray = field(default_factory=lambda: placement(570.0, 0.0, 120.0, 0.0, 0.0, 0.0))
    T_TW: FloatArray = field(default_factory=lambda: np.eye(4))
    T_FS: FloatArray = field(default_factory=lambda: placement(0.0, 0.0, 100.0, 0.0, 0.0, 0.0))
    table: Table = field(default_factory=Table)
    probe: Probe = field(default_factory=Probe)

    def __post_init__(self) -> None:
        for name, T in (("T_BT", self.T_BT), ("T_TW", self.T_TW), ("T_FS", self.T_FS)):
            fault = first_not_rigid(T[np.newaxis])
            if fault is not None:
                raise PoseError(f"{name} {fault[1]}")

    def table_factors(self, angles_deg: FloatArray) -> FloatArray:
        """Return T_BT Rz(theta) `(m, 4, 4)` for table angles `(m,)`: the left factor of every goal."""
        return self.T_BT @ rotations_z(angles_deg)

    def location_factors(self, T_WS: FloatArray) -> FloatArray:
        """Return T_TW T_L inv(T_FS) `(n, 4, 4)` for scan locations `(n, 4, 4)`: the right factor of every goal."""
        return self.T_TW @ T_WS @ rigid_inverse(self.T_FS)
