"""A scan path: the required poses of the probe in the workpiece frame, one per location, at a constant time step."""

import csv
from dataclasses import dataclass
from itertools import chain
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from planner.arrays import FloatArray
from planner.errors import PathError
from planner.geometry.transforms import first_not_rigid, from_xyz_yaw_pitch_roll, nearest_rigid
from protocol.files.data_file import DataFileError, read_json, read_text, shown

_ROWS = 4  # of a matrix
MOST_LOCATIONS = 20_000
"""More than any useful path: a day at one location every 4 s."""


@dataclass(frozen=True, eq=False)
class ScanPath:
    """Scan locations and the time between two of them.

    Attributes:
        T_WS: poses of the probe in the workpiece frame, T_L in the paper, `(n, 4, 4)` in mm.
        step_s: time from one location to the next.

    Raises:
        PathError: fewer than two locations, a pose that is not rigid, or a step that is not above 0.
    """

    T_WS: FloatArray
    step_s: float

    def __post_init__(self) -> None:
        if len(self.T_WS) < 2:
            raise PathError(f"the number of locations of the path is {len(self.T_WS)}; it must be at least 2")
        if not 0.0 < self.step_s < np.inf:
            raise PathError(f"the path's time step is {self.step_s:g} s; it must be above 0")
        fault = first_not_rigid(self.T_WS)
        if fault is not None:
            raise PathError(f"location {fault[0] + 1} of the path {fault[1]}")

    @property
    def count(self) -> int:
        """The number of locations."""
        return len(self.T_WS)


def looking_at(points: FloatArray, normals: FloatArray, lines: FloatArray, stand_off_mm: float) -> FloatArray:
    """Return poses of a probe `(n, 4, 4)` at p + stand-off n with the beam along -n.

    Args:
        points: points p on the surface, `(n, 3)` in mm.
        normals: outward unit normals n, `(n, 3)`.
        lines: directions of the laser line, `(n, 3)`; only the component perpendicular to the normal counts.
        stand_off_mm: distance of the probe from p.
    """
    T = np.tile(np.eye(4), (len(points), 1, 1))
    beam = -normals
    along = lines - np.sum(lines * beam, axis=1, keepdims=True) * beam
    T[:, :3, 0] = along / np.linalg.norm(along, axis=1, keepdims=True)
    T[:, :3, 1] = np.cross(beam, T[:, :3, 0])
    T[:, :3, 2] = beam
    T[:, :3, 3] = points + stand_off_mm * normals
    return T


def at_scan_speed(
    waypoints: FloatArray, speed_mm_s: float, step_s: float, stand_off_mm: float, line_width_mm: float
) -> ScanPath:
    """Return the path through `waypoints` `(n, 4, 4)` along which the line moves over the surface at constant speed.

    This is the maximum speed of the line's middle and ends, so a rotation on the spot takes time too. All steps are
    equal, and the last one ends at the last waypoint. Therefore the speed is adjusted, by less than half a step over
    the whole path.
    """
    line = 0.5 * line_width_mm
    marks = np.array([[-line, 0, stand_off_mm, 1], [0, 0, stand_off_mm, 1], [line, 0, stand_off_mm, 1]])
    on_surface = (waypoints @ marks.T)[:, :3]
    lengths = np.linalg.norm(np.diff(on_surface, axis=0), axis=1).max(axis=1)
    moving = np.concatenate(([True], lengths > 1e-9))
    waypoints, travelled = waypoints[moving], np.concatenate(([0.0], np.cumsum(lengths)))[moving]
    with np.errstate(over="ignore", divide="ignore"):
        steps = travelled[-1] / (speed_mm_s * step_s)
    if not steps < MOST_LOCATIONS:
        raise PathError(
            f"a path of {travelled[-1]:.0f} mm at scan_speed_mm_s {speed_mm_s:g} with time_step_s {step_s:g} has"
            f" {steps:.3g} locations; at most {MOST_LOCATIONS:,} are allowed; increase the speed or the time step"
        )
    count = max(2, 1 + round(steps))
    if len(waypoints) < 2:
        raise PathError("all locations of the path are equal; it must have at least 2 different locations")
    at = np.linspace(0.0, travelled[-1], count)
    T = np.tile(np.eye(4), (count, 1, 1))
    T[:, :3, :3] = Slerp(travelled, Rotation.from_matrix(waypoints[:, :3, :3]))(at).as_matrix()
    for axis in range(3):
        T[:, axis, 3] = np.interp(at, travelled, waypoints[:, axis, 3])
    return ScanPath(T, step_s)


def load_scan_path(file: Path, step_s: float) -> ScanPath:
    """Return the path from a CSV or JSON file of poses.

    A pose is six numbers, x y z in mm and yaw pitch roll in degrees. It may also be the sixteen numbers of a 4 x 4
    matrix by rows. A CSV file has one pose per line, after an optional header line. A JSON file is a list of poses,
    where a matrix may also be a list of its rows.

    Raises:
        PathError: the file cannot be read, or a pose is not six or sixteen finite numbers, or not rigid.
    """
    kinds = {".csv": _rows_of_csv, ".json": _rows_of_json}
    if file.suffix.lower() not in kinds:
        raise PathError(f"{file}: a path file must end in .csv or .json")
    try:
        rows = kinds[file.suffix.lower()](file)
    except DataFileError as error:
        raise PathError(str(error)) from error
    if len(rows) > MOST_LOCATIONS:
        raise PathError(f"{file}: holds {len(rows):,} poses; at most {MOST_LOCATIONS:,} are allowed")
    poses = [pose_of(f"{file}: pose {i}", row) for i, row in enumerate(rows, 1)]
    try:
        return ScanPath(np.array(poses).reshape(-1, 4, 4), step_s)
    except PathError as error:
        raise PathError(f"{file}: {error}") from error


def _rows_of_csv(file: Path) -> list[list[float]]:
    rows: list[list[float]] = []
    try:
        lines = list(csv.reader(read_text(file).splitlines()))
    except csv.Error as error:
        raise PathError(f"{file}: is not a CSV file: {error}") from error
    for number, row in enumerate(lines, 1):
        if not any(cell.strip() for cell in row):
            continue
        try:
            rows.append([float(cell) for cell in row])
        except ValueError:
            if number > 1:
                raise PathError(
                    f"{file}: line {number} holds {shown(','.join(row))}; numbers only are allowed"
                ) from None
    return rows


def _rows_of_json(file: Path) -> list[list[float]]:
    poses = read_json(file)
    if not isinstance(poses, list):
        raise PathError(f"{file}: must hold a list of poses")
    rows = [numbers_of(one) for one in poses]
    if None in rows:
        raise PathError(
            f"{file}: pose {rows.index(None) + 1} must be a list of 6 numbers, or a 4 x 4 matrix of numbers"
        )
    return [row for row in rows if row is not None]


def numbers_of(pose: object) -> list[float] | None:
    """Return the numbers of a pose read from JSON, a list of them or four rows of four; None for anything else."""
    if not isinstance(pose, list):
        return None
    is_matrix = len(pose) == _ROWS and all(isinstance(row, list) and len(row) == _ROWS for row in pose)
    numbers = list(chain.from_iterable(pose)) if is_matrix else pose
    if not all(isinstance(each, int | float) and not isinstance(each, bool) for each in numbers):
        return None
    try:
        return [float(each) for each in numbers]
    except OverflowError:  # an integer of hundreds of digits
        return None


def pose_of(where: str, row: list[float]) -> FloatArray:
    """Return the pose (4, 4) of six or sixteen numbers.

    Raises:
        PathError: They are not a pose; the message begins with `where`.
    """
    if len(row) not in (6, 16):
        raise PathError(
            f"{where} has {len(row)} numbers; allowed are 6 (x y z yaw pitch roll) or the 16 of a 4 x 4 matrix"
        )
    if not np.isfinite(row).all():
        raise PathError(f"{where} holds a value that is not a finite number")
    if len(row) == 6:
        return np.asarray(from_xyz_yaw_pitch_roll(np.array([row]))[0])
    T = np.array(row).reshape(1, 4, 4)
    fault = first_not_rigid(T)
    if fault is not None:
        raise PathError(f"{where} {fault[1]}")
    return np.asarray(nearest_rigid(T)[0])
