"""Find the table's axis from a reference sphere that turns with the table: its centre moves on a circle.

A fit that is not plausible is refused, with the figure that says so.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from planner.arrays import FloatArray
from planner.errors import PlannerError
from planner.geometry.transforms import rotations_z

# The least that determines an axis, and one more to judge it by.
_FEWEST_ANGLES = 4
# A circle that short or that small does not say where its axis is.
_SHORTEST_ARC_DEG = 90.0
_SMALLEST_CIRCLE_MM = 10.0
_GREATEST_AXIS_ERROR_DEG = 10.0


class CalibrationError(PlannerError):
    """Measurements that do not determine a placement, or contradict each other."""


@dataclass(frozen=True, eq=False)
class AxisCalibration:
    """Where the table's axis is.

    Attributes:
        T_BT: The table in the base, `(4, 4)`: z along the axis; origin and x as near to the nominal ones as z allows.
        residuals_mm: `(n,)` distance of each sphere centre from where the fit has it.
        rms_mm: Their root mean square.
    """

    T_BT: FloatArray
    residuals_mm: FloatArray
    rms_mm: float


def calibrate_table_axis(
    centres_B: FloatArray, angles_deg: FloatArray, nominal_T_BT: FloatArray, greatest_rms_mm: float = 0.1
) -> AxisCalibration:
    """Return the table's axis from the centres of a sphere that turns with it.

    A point on the table is at a + cos(theta) u + sin(theta) v, with u and v at right angles and of equal length. The
    linear fit without those two conditions gives the start for the fit with them. What the centres cannot tell, where
    along the axis the table's top is and which direction angle 0 has, is taken from the nominal placement.

    Args:
        centres_B: Centres in the base, `(n, 3)` in mm.
        angles_deg: The table's angle at each, `(n,)`.
        nominal_T_BT: About where the table is.
        greatest_rms_mm: A worse fit is refused.

    Raises:
        CalibrationError: The centres do not determine an axis, or do not lie as on a turning table.
    """
    _check_angles(centres_B, angles_deg)
    theta = np.radians(angles_deg)
    design = np.column_stack((np.ones_like(theta), np.cos(theta), np.sin(theta)))
    middle, u, v = np.linalg.lstsq(design, centres_B, rcond=None)[0]
    axis = np.cross(u, v)
    radius_mm = float(np.sqrt(np.linalg.norm(axis)))
    if radius_mm < _SMALLEST_CIRCLE_MM:
        raise CalibrationError(
            f"the sphere turns on a circle of only {radius_mm:.1f} mm radius;"
            f" put it at least {_SMALLEST_CIRCLE_MM:g} mm off the table's axis"
        )
    start = _placed_on_axis(nominal_T_BT, middle, axis / np.linalg.norm(axis))
    seat_T = rotations_z(-angles_deg)[:, :3, :3] @ ((centres_B - start[:3, 3]) @ start[:3, :3])[:, :, np.newaxis]

    def residuals(unknown: FloatArray) -> FloatArray:
        T_BT = _tilted(start, unknown[:4])
        on_circle = rotations_z(angles_deg)[:, :3, :3] @ unknown[4:]
        return np.asarray((on_circle @ T_BT[:3, :3].T + T_BT[:3, 3] - centres_B).ravel())

    fit = least_squares(residuals, np.concatenate((np.zeros(4), seat_T.mean(axis=0).ravel())), x_scale="jac")
    T_BT = _tilted(start, fit.x[:4])
    each_mm = np.linalg.norm(fit.fun.reshape(-1, 3), axis=1)
    rms_mm = float(np.sqrt(np.mean(each_mm**2)))
    if rms_mm > greatest_rms_mm:
        raise CalibrationError(
            f"the sphere's centres lie {rms_mm:.3f} mm (rms) off a turning table's circle; allowed are"
            f" {greatest_rms_mm:g} mm: were the sphere or the table's foot loose, or the angles not those of the views?"
        )
    _check_axis(T_BT, nominal_T_BT)
    return AxisCalibration(_placed_on_axis(nominal_T_BT, T_BT[:3, 3], T_BT[:3, 2]), each_mm, rms_mm)


def _check_angles(centres_B: FloatArray, angles_deg: FloatArray) -> None:
    if len(centres_B) != len(angles_deg) or len(angles_deg) < _FEWEST_ANGLES:
        raise CalibrationError(
            f"there are {len(centres_B)} sphere centres and {len(angles_deg)} table angles;"
            f" the axis needs as many of either, and at least {_FEWEST_ANGLES}"
        )
    if not (np.isfinite(centres_B).all() and np.isfinite(angles_deg).all()):
        raise CalibrationError("a sphere centre or a table angle is not a finite number")
    arc_deg = _shortest_arc_deg(angles_deg)
    if arc_deg < _SHORTEST_ARC_DEG:
        raise CalibrationError(
            f"the table angles span only {arc_deg:.0f} deg; the axis needs at least {_SHORTEST_ARC_DEG:g}"
        )


def _shortest_arc_deg(angles_deg: FloatArray) -> float:
    """Return the shortest arc that holds all the angles."""
    turned = np.sort(np.mod(angles_deg, 360.0))
    return float(360.0 - np.max(np.diff(turned, append=turned[0] + 360.0)))


def _check_axis(T_BT: FloatArray, nominal_T_BT: FloatArray) -> None:
    cosine = float(np.clip(T_BT[:3, 2] @ nominal_T_BT[:3, 2], -1.0, 1.0))
    off_deg = float(np.degrees(np.arccos(cosine)))
    if off_deg > _GREATEST_AXIS_ERROR_DEG:
        raise CalibrationError(
            f"the axis found is {off_deg:.1f} deg off the nominal one; allowed are {_GREATEST_AXIS_ERROR_DEG:g}:"
            " does the table count the other way round?"
        )


def _placed_on_axis(nominal_T_BT: FloatArray, point: FloatArray, axis: FloatArray) -> FloatArray:
    """Return the placement about an axis whose origin and x direction are the nearest to the nominal ones."""
    T = np.eye(4)
    x = nominal_T_BT[:3, 0] - (nominal_T_BT[:3, 0] @ axis) * axis
    T[:3, 2], T[:3, 0] = axis, x / np.linalg.norm(x)
    T[:3, 1] = np.cross(T[:3, 2], T[:3, 0])
    T[:3, 3] = point + ((nominal_T_BT[:3, 3] - point) @ axis) * axis
    return T


def _tilted(T: FloatArray, tilt_and_shift: FloatArray) -> FloatArray:
    """Return T moved by two angles (rad) about its x and y, and two lengths (mm) along them."""
    moved = np.eye(4)
    moved[:3, :3] = Rotation.from_rotvec((*tilt_and_shift[:2], 0.0)).as_matrix()
    moved[:2, 3] = tilt_and_shift[2:]
    return np.asarray(T @ moved)


def sphere_centre(points: FloatArray, radius_mm: float) -> FloatArray:
    """Return the centre `(3,)` of a sphere of known radius through points `(m, 3)`, by least squares."""
    # |p|^2 = 2 p.c + (r^2 - |c|^2) is linear and gives the start.
    design = np.column_stack((2.0 * points, np.ones(len(points))))
    start = np.linalg.lstsq(design, np.sum(points**2, axis=1), rcond=None)[0][:3]

    def heights(centre: FloatArray) -> FloatArray:
        return np.asarray(np.linalg.norm(points - centre, axis=1) - radius_mm)

    return np.asarray(least_squares(heights, start).x)
