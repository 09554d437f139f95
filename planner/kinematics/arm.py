"""A six-axis arm with a spherical wrist: its Denavit-Hartenberg table and its forward kinematics.

Standard convention (Spong et al., 2005): frame i follows frame i - 1 by Rz(theta i) Tz(d) Tx(a) Rx(alpha).

Manufacturers count joint angles from another zero, and some joints in the opposite direction: theta = sign x angle +
offset. All computations use theta, in radians. Files contain the robot's own angles, in degrees.
"""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from planner.arrays import FloatArray
from planner.errors import ArmTableError, ScanFileError
from planner.kernel import kernel
from protocol.files.toml_table import TomlTable

_SHIPPED = Path(__file__).parents[1] / "arms"
_ORTHO_PARALLEL_ALPHA_DEG = (-90.0, 0.0, 90.0, -90.0, 90.0, 0.0)


# The columns of the table for the compiled kernels, one row per joint.
D_MM, A_MM, COS_ALPHA, SIN_ALPHA, LOWER_RAD, UPPER_RAD = range(6)


def shipped_arms() -> list[str]:
    """Return the names of the shipped arms."""
    return sorted(file.stem for file in _SHIPPED.glob("*.toml"))


@dataclass(frozen=True)
class Arm:
    """A Denavit-Hartenberg table with joint limits and speeds, one entry per joint.

    Attributes:
        name: the manufacturer's name of the arm.
        d_mm: offsets along the joint axes.
        a_mm: lengths of the common normals.
        alpha_deg: twists around the common normals.
        lower_deg: lower joint limits, in the robot's own angles.
        upper_deg: upper joint limits, in the robot's own angles.
        max_speed_deg_s: maximum joint speeds.
        sign: 1, or -1 for a joint that the robot counts in the opposite direction.
        offset_deg: angle in the table when the robot's own angle is 0.

    Raises:
        ArmTableError: the arm is not ortho-parallel with a spherical wrist, its limits are inconsistent, or a sign is
            not 1 or -1. The closed-form inverse kinematics need such an arm.
    """

    name: str
    d_mm: tuple[float, ...]
    a_mm: tuple[float, ...]
    alpha_deg: tuple[float, ...]
    lower_deg: tuple[float, ...]
    upper_deg: tuple[float, ...]
    max_speed_deg_s: tuple[float, ...]
    sign: tuple[float, ...] = (1.0,) * 6
    offset_deg: tuple[float, ...] = (0.0,) * 6

    def __post_init__(self) -> None:
        limits = (self.lower_deg, self.upper_deg, self.max_speed_deg_s)
        columns = (self.d_mm, self.a_mm, self.alpha_deg, *limits, self.sign, self.offset_deg)
        if any(len(column) != 6 or not all(map(math.isfinite, column)) for column in columns):
            raise ArmTableError(f"{self.name}: each column of the arm's table must hold 6 finite numbers")
        self._check_shape()
        bounds = zip(self.lower_deg, self.upper_deg, self.max_speed_deg_s, strict=True)
        for joint, (lower, upper, speed) in enumerate(bounds, 1):
            if not lower < upper:
                raise ArmTableError(
                    f"{self.name}: limits of joint {joint} are {lower:g}..{upper:g} deg; the lower must come first"
                )
            if not speed > 0:
                raise ArmTableError(f"{self.name}: speed of joint {joint} is {speed:g} deg/s; it must be above 0")
        for joint, sign in enumerate(self.sign, 1):
            if abs(sign) != 1.0:
                raise ArmTableError(f"{self.name}: sign of joint {joint} is {sign:g}; it must be 1 or -1")

    def _check_shape(self) -> None:
        mirrored = tuple(-alpha for alpha in _ORTHO_PARALLEL_ALPHA_DEG)
        if self.alpha_deg not in (_ORTHO_PARALLEL_ALPHA_DEG, mirrored):
            raise ArmTableError(
                f"{self.name}: alpha_deg is {self.alpha_deg}; an ortho-parallel arm with a spherical wrist has"
                f" {_ORTHO_PARALLEL_ALPHA_DEG} or all of them negated"
            )
        if any(self.a_mm[3:]) or self.d_mm[4]:
            raise ArmTableError(
                f"{self.name}: a_mm of joints 4 to 6 and d_mm of joint 5 are {self.a_mm[3:]} and {self.d_mm[4]:g};"
                " in a spherical wrist they are 0"
            )
        if not (self.a_mm[1] > 0 and math.hypot(self.a_mm[2], self.d_mm[3]) > 0):
            raise ArmTableError(f"{self.name}: a_mm of joint 2 and the forearm's length must be above 0")

    @classmethod
    def load(cls, file: Path | str = "viper_s650") -> "Arm":
        """Return the arm of a TOML file, or a shipped arm by its name.

        Raises:
            ScanFileError: the file cannot be read, or a key is missing, unknown or of the wrong type.
            ArmTableError: see the class.
        """
        shipped = _SHIPPED / f"{file}.toml"
        top = TomlTable.load(shipped if shipped.is_file() else Path(file), ScanFileError)
        name = top.text("name")
        rows = top.tables("joint", 6)
        limits = [row.numbers("limits_deg", 2) for row in rows]
        d_mm, a_mm, alpha_deg, max_speed_deg_s = (
            tuple(row.number(key) for row in rows) for key in ("d_mm", "a_mm", "alpha_deg", "max_speed_deg_s")
        )
        sign, offset_deg = (
            tuple(row.number(key, value) for row in rows) for key, value in (("sign", 1), ("offset_deg", 0))
        )
        for table in (top, *rows):
            table.finish()
        lower_deg, upper_deg = zip(*limits, strict=True)
        return cls(name, d_mm, a_mm, alpha_deg, lower_deg, upper_deg, max_speed_deg_s, sign, offset_deg)

    def joints(self, robot_deg: FloatArray) -> FloatArray:
        """Return the table's joints `(n, 6)` in radians for the robot's own angles `(n, 6)` in degrees."""
        return np.asarray(np.radians(robot_deg * np.array(self.sign) + self.offset_deg))

    def robot_deg(self, joints: FloatArray) -> FloatArray:
        """Return the robot's own angles `(n, 6)` in degrees for the table's joints `(n, 6)` in radians."""
        return np.asarray((np.degrees(joints) - self.offset_deg) * np.array(self.sign))

    @property
    def limits(self) -> FloatArray:
        """The lower and the upper joint limits `(2, 6)`, as joints of the table, in radians."""
        return np.asarray(np.sort(self.joints(np.array([self.lower_deg, self.upper_deg])), axis=0))

    @property
    def table(self) -> FloatArray:
        """The `(6, 6)` table as the kernels take it: one row per joint, the columns named D_MM to UPPER_RAD."""
        # The twists are multiples of 90 degrees, with integer sines and cosines.
        alpha = np.radians(self.alpha_deg)
        return np.column_stack((self.d_mm, self.a_mm, np.rint(np.cos(alpha)), np.rint(np.sin(alpha)), *self.limits))

    def flange_poses(self, joints: FloatArray) -> FloatArray:
        """Return T_BF `(n, 4, 4)`, flange in base, in mm, for joints `(n, 6)` in radians."""
        return self.link_frames(joints)[:, 6]

    def link_frames(self, joints: FloatArray) -> FloatArray:
        """Return the frames `(n, 7, 4, 4)` in the base, in mm: base, then the frame after each joint."""
        frames = np.zeros((len(joints), 7, 4, 4))
        frames[:, :, 3, 3] = 1.0
        _link_frames_of_each(self.table, np.ascontiguousarray(joints, dtype=np.float64), frames)
        return frames


@kernel
def link_frames(arm: FloatArray, joints: FloatArray, frames: FloatArray) -> None:
    """Write the base frame and the frame after each joint to `frames`, for an arm's table and joints `(6,)`.

    Only the upper three rows are written, so `frames` may be `(7, 3, 4)` or `(7, 4, 4)`. The last frame is the flange.
    Fewer frames are those of the first joints.
    """
    for row in range(3):
        for column in range(4):
            frames[0, row, column] = 1.0 if row == column else 0.0
    for j in range(len(frames) - 1):
        c, s = math.cos(joints[j]), math.sin(joints[j])
        ca, sa = arm[j, COS_ALPHA], arm[j, SIN_ALPHA]
        a, d = arm[j, A_MM], arm[j, D_MM]
        for row in range(3):
            x, y, z = frames[j, row, 0], frames[j, row, 1], frames[j, row, 2]
            across = c * y - s * x
            frames[j + 1, row, 0] = c * x + s * y
            frames[j + 1, row, 1] = ca * across + sa * z
            frames[j + 1, row, 2] = ca * z - sa * across
            frames[j + 1, row, 3] = frames[j, row, 3] + a * frames[j + 1, row, 0] + d * z


@kernel
def _link_frames_of_each(arm: FloatArray, joints: FloatArray, frames: FloatArray) -> None:
    for i in range(len(joints)):
        link_frames(arm, joints[i], frames[i])
