"""Find the table's axis with a reference sphere that turns with the table: its center moves on a circle.

A fit that is not plausible, or too uncertain for the scan, is refused; the message states the figure.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy import stats
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from planner.arrays import FloatArray
from planner.errors import PlannerError
from planner.geometry.transforms import rotations_z
from planner.scanning.score_tests import FALSE_ALARMS, Change, NormalEquations, find_change

GREATEST_POINT_ERROR_MM = 0.1
"""Maximum displacement (1 sigma) of a scan point by the uncertainty of a calibration: four times the probe's noise."""
# Three points determine an axis, and one more checks it. Angles closer than this are the same place.
_FEWEST_PLACES = 4
_SAME_PLACE_DEG = 10.0
# Minimum assumed noise of a sphere's center: few residuals can agree by chance.
_LEAST_NOISE_MM = 0.002
# Two tests share the allowed false alarms: of all residuals together, and of their order.
_ALARMS_EACH = FALSE_ALARMS / 2.0
# The unknowns of the fit: tilt (rad) and shift (mm) of the axis, and position of the sphere on the table (mm).
_AXIS, _SEAT = slice(0, 4), slice(4, 7)
# A shorter arc or a smaller circle does not determine its axis.
_SHORTEST_ARC_DEG = 90.0
_SMALLEST_CIRCLE_MM = 10.0
_GREATEST_AXIS_ERROR_DEG = 10.0


class CalibrationError(PlannerError):
    """Measurements that do not determine a placement, or that are inconsistent."""


class PartSize(NamedTuple):
    """The cylinder around the table's axis that contains the part, from the table's top upward, in mm."""

    radius_mm: float = 150.0
    height_mm: float = 200.0


@dataclass(frozen=True, eq=False)
class AxisCalibration:
    """The axis of the table.

    Attributes:
        T_BT: pose of the table in the base, `(4, 4)`: z along the axis; origin and x as near to the nominal ones as z
            allows.
        residuals_mm: `(n,)` distance of each sphere center from the fitted position.
        rms_mm: their root mean square.
        uncertainty_mm: expected distance (root mean square) of the axis from the true one, at the table's top.
        uncertainty_deg: expected angle (root mean square) between the two.
        point_error_mm: root mean square of the displacement by both together, at the worst point of the part.
    """

    T_BT: FloatArray
    residuals_mm: FloatArray
    rms_mm: float
    uncertainty_mm: float
    uncertainty_deg: float
    point_error_mm: float


def calibrate_table_axis(
    centers_B: FloatArray,
    angles_deg: FloatArray,
    nominal_T_BT: FloatArray,
    greatest_rms_mm: float = 0.2,
    noise_mm: float | None = None,
    part: PartSize | None = None,
) -> AxisCalibration:
    """Return the table's axis from the centers of a sphere that turns with it.

    A point on the table is at a + cos(theta) u + sin(theta) v, with u and v perpendicular and of equal length. The
    linear fit without these two conditions gives the start for the fit with them. The centers do not determine the
    position of the table's top along the axis, and the direction of angle 0. Both are taken from the nominal placement.

    The uncertainty follows from the covariance of the fit. The fit is refused if a point of the part would move by more
    than `GREATEST_POINT_ERROR_MM`. The residuals are tested for a sphere that moved on the table.

    Args:
        centers_B: centers in the base, `(n, 3)` in mm, in the order of the measurements.
        angles_deg: table angle of each, `(n,)`.
        nominal_T_BT: approximate pose of the table.
        greatest_rms_mm: maximum residual of an accepted fit.
        noise_mm: standard deviation of each coordinate of a center. By default it is estimated from the residuals, with
            a minimum of 0.002 mm.
        part: the part of the scan.

    Raises:
        CalibrationError: the centers do not determine the axis with sufficient accuracy, or are not on a circle around
            it.
    """
    _check_angles(centers_B, angles_deg)
    if noise_mm is not None:
        check_noise(noise_mm)
    start, seat_T = _start(centers_B, angles_deg, nominal_T_BT)

    def residuals(unknown: FloatArray) -> FloatArray:
        T_BT = _tilted(start, unknown[_AXIS])
        on_circle = rotations_z(angles_deg)[:, :3, :3] @ unknown[_SEAT]
        return np.asarray((on_circle @ T_BT[:3, :3].T + T_BT[:3, 3] - centers_B).ravel())

    fit = least_squares(residuals, np.concatenate((np.zeros(4), seat_T)), x_scale="jac")
    T_BT = _tilted(start, fit.x[_AXIS])
    each_mm = np.linalg.norm(fit.fun.reshape(-1, 3), axis=1)
    rms_mm = float(np.sqrt(np.mean(each_mm**2)))
    if rms_mm > greatest_rms_mm:
        raise CalibrationError(
            f"the sphere's centers lie {rms_mm:.3f} mm (rms) off a turning table's circle; allowed are"
            f" {greatest_rms_mm:g} mm; check that sphere and table are fixed, and that the angles belong to the views"
        )
    freedom = len(fit.fun) - len(fit.x)
    estimated_mm = float(np.sqrt(np.sum(fit.fun**2) / freedom))
    deviation_mm = max(estimated_mm, _LEAST_NOISE_MM if noise_mm is None else noise_mm)
    jacobian = np.asarray(fit.jac)
    _check_residuals(fit.fun, jacobian, angles_deg, noise_mm, rms_mm)
    _check_axis(T_BT, nominal_T_BT)
    covariance = deviation_mm**2 * np.linalg.pinv(jacobian.T @ jacobian, hermitian=True)[_AXIS, _AXIS]
    uncertainty = _uncertainty(covariance, part or PartSize())
    return AxisCalibration(_placed_on_axis(nominal_T_BT, T_BT[:3, 3], T_BT[:3, 2]), each_mm, rms_mm, *uncertainty)


def _start(centers_B: FloatArray, angles_deg: FloatArray, nominal_T_BT: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the approximate pose of the table, and the position of the sphere on it, from a linear fit."""
    theta = np.radians(angles_deg)
    design = np.column_stack((np.ones_like(theta), np.cos(theta), np.sin(theta)))
    middle, u, v = np.linalg.lstsq(design, centers_B, rcond=None)[0]
    axis = np.cross(u, v)
    radius_mm = float(np.sqrt(np.linalg.norm(axis)))
    if radius_mm < _SMALLEST_CIRCLE_MM:
        raise CalibrationError(
            f"the sphere turns on a circle of only {radius_mm:.1f} mm radius;"
            f" place it at least {_SMALLEST_CIRCLE_MM:g} mm off the table's axis"
        )
    start = _placed_on_axis(nominal_T_BT, middle, axis / np.linalg.norm(axis))
    seats_T = rotations_z(-angles_deg)[:, :3, :3] @ ((centers_B - start[:3, 3]) @ start[:3, :3])[:, :, np.newaxis]
    return start, seats_T.mean(axis=0).ravel()


def _check_residuals(
    residuals_mm: FloatArray, jacobian: FloatArray, angles_deg: FloatArray, noise_mm: float | None, rms_mm: float
) -> None:
    """Refuse residuals that are larger than the noise, or show that the sphere moved on the table."""
    deviation_mm = noise_mm if noise_mm is not None else 1.0
    groups = np.repeat(np.arange(len(angles_deg)), 3)
    equations = NormalEquations.of(residuals_mm / deviation_mm, jacobian / deviation_mm, groups)
    change = find_change(equations, _SEAT, _ALARMS_EACH, noise_is_known=noise_mm is not None)
    # Values far below the noise of any sphere are rounding, in any order.
    if change is not None and (noise_mm is not None or rms_mm > 0.1 * _LEAST_NOISE_MM):
        raise CalibrationError(
            f"the sphere's centers lie {rms_mm:.3f} mm (rms) off a turning table's circle, and {_what_changed(change)}"
        )
    if noise_mm is not None and stats.chi2.sf(equations.chi_square, equations.freedom) < _ALARMS_EACH:
        ratio = np.sqrt(equations.chi_square / equations.freedom)
        raise CalibrationError(
            f"the sphere's centers lie {rms_mm:.3f} mm (rms) off a turning table's circle, {ratio:.1f} times their"
            " noise; check that sphere and table are fixed, and that the angles belong to the views"
        )


def _what_changed(change: Change) -> str:
    if change.kind == "drift":
        return "the sphere drifts on the table; check that it is fixed, and that the cell is warm"
    if change.kind == "step":
        return f"the position of the sphere changes at center {change.group + 1}; check that it did not move"
    return f"center {change.group + 1} does not agree with the others; check its angle"


def _uncertainty(covariance: FloatArray, part: PartSize) -> tuple[float, float, float]:
    """Return the standard deviations of the axis (mm and deg), and of a point at the worst place of the part (mm)."""
    tilt_rad, shift_mm = (float(np.sqrt(np.trace(block))) for block in (covariance[:2, :2], covariance[2:, 2:]))
    azimuth = np.radians(np.arange(0.0, 360.0, 15.0))
    error_mm = max(
        float(np.sqrt(np.trace(moves @ covariance @ moves.T)))
        for z in (0.0, part.height_mm)
        for x, y in part.radius_mm * np.column_stack((np.cos(azimuth), np.sin(azimuth)))
        for moves in [np.array([[0.0, z, 1.0, 0.0], [-z, 0.0, 0.0, 1.0], [y, -x, 0.0, 0.0]])]
    )
    if not error_mm <= GREATEST_POINT_ERROR_MM:
        raise CalibrationError(
            f"the centers leave the table's axis open by {shift_mm:.2g} mm and {np.degrees(tilt_rad):.2g} deg (1 sigma)"
            f"; a point of a part of {part.radius_mm:g} mm radius and {part.height_mm:g} mm height is then"
            f" {error_mm:.2g} mm wrong; allowed are {GREATEST_POINT_ERROR_MM:g} mm; spread the table angles,"
            " or place the sphere farther from the axis"
        )
    return shift_mm, float(np.degrees(tilt_rad)), error_mm


def _check_angles(centers_B: FloatArray, angles_deg: FloatArray) -> None:
    if len(centers_B) != len(angles_deg) or len(angles_deg) < _FEWEST_PLACES:
        raise CalibrationError(
            f"there are {len(centers_B)} sphere centers and {len(angles_deg)} table angles;"
            f" the axis needs equal numbers of both, and at least {_FEWEST_PLACES}"
        )
    if not (np.isfinite(centers_B).all() and np.isfinite(angles_deg).all()):
        raise CalibrationError("a sphere center or a table angle is not a finite number")
    arc_deg = _shortest_arc_deg(angles_deg)
    if arc_deg < _SHORTEST_ARC_DEG:
        raise CalibrationError(
            f"the table angles span only {arc_deg:.0f} deg; the axis needs at least {_SHORTEST_ARC_DEG:g}"
        )
    places = _distinct_places(angles_deg)
    if places < _FEWEST_PLACES:
        raise CalibrationError(
            f"the {len(angles_deg)} table angles are only {places} distinct places; the axis needs at least"
            f" {_FEWEST_PLACES} that are {_SAME_PLACE_DEG:g} deg apart"
        )


def check_noise(noise_mm: float) -> None:
    """Refuse an invalid noise."""
    if not 0.0 < noise_mm < np.inf:
        raise CalibrationError(f"the noise is {noise_mm:g} mm; it must be a finite number above 0")


def _distinct_places(angles_deg: FloatArray) -> int:
    """Return the number of distinct angles."""
    turned = np.sort(np.mod(angles_deg, 360.0))
    # Counting starts after the widest gap, so that no place is on both sides of 0.
    turned = np.roll(turned, -int(np.argmax(np.diff(turned, prepend=turned[-1] - 360.0))))
    ways = np.mod(turned - turned[0], 360.0)
    places, last = 0, -np.inf
    for way in ways.tolist():
        if way >= last + _SAME_PLACE_DEG - 1e-6:
            places, last = places + 1, way
    return places


def _shortest_arc_deg(angles_deg: FloatArray) -> float:
    """Return the shortest arc that contains all the angles."""
    turned = np.sort(np.mod(angles_deg, 360.0))
    return float(360.0 - np.max(np.diff(turned, append=turned[0] + 360.0)))


def _check_axis(T_BT: FloatArray, nominal_T_BT: FloatArray) -> None:
    cosine = float(np.clip(T_BT[:3, 2] @ nominal_T_BT[:3, 2], -1.0, 1.0))
    off_deg = float(np.degrees(np.arccos(cosine)))
    if off_deg > _GREATEST_AXIS_ERROR_DEG:
        raise CalibrationError(
            f"the axis found is {off_deg:.1f} deg off the nominal one; allowed are {_GREATEST_AXIS_ERROR_DEG:g};"
            " check the direction in which the table counts"
        )


def _placed_on_axis(nominal_T_BT: FloatArray, point: FloatArray, axis: FloatArray) -> FloatArray:
    """Return the placement with a given axis, whose origin and x direction are nearest to the nominal ones."""
    T = np.eye(4)
    x = nominal_T_BT[:3, 0] - (nominal_T_BT[:3, 0] @ axis) * axis
    T[:3, 2], T[:3, 0] = axis, x / np.linalg.norm(x)
    T[:3, 1] = np.cross(T[:3, 2], T[:3, 0])
    T[:3, 3] = point + ((nominal_T_BT[:3, 3] - point) @ axis) * axis
    return T


def _tilted(T: FloatArray, tilt_and_shift: FloatArray) -> FloatArray:
    """Return T rotated by two angles (rad) around its x and y, and shifted by two lengths (mm) along them."""
    moved = np.eye(4)
    moved[:3, :3] = Rotation.from_rotvec((*tilt_and_shift[:2], 0.0)).as_matrix()
    moved[:2, 3] = tilt_and_shift[2:]
    return np.asarray(T @ moved)
