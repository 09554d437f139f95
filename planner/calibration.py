"""Find the placements that alignment needs, from a reference sphere.

The table's axis follows from a sphere that turns with the table: its centre moves on a circle. The probe's place on the
flange follows from a sphere that stands still: seen from many poses, all points must lie on one sphere. A fit that is
not plausible is refused, with the figure that says so.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import permutations, product

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from planner.arrays import FloatArray
from planner.errors import PlannerError
from planner.transforms import rotations_z

# The least that determines an axis, and one more to judge it by.
_FEWEST_ANGLES = 4
_FEWEST_POSES = 6
# A circle that short or that small does not say where its axis is.
_SHORTEST_ARC_DEG = 90.0
_SMALLEST_CIRCLE_MM = 10.0
_GREATEST_AXIS_ERROR_DEG = 10.0
# Points a view that a search for the right minimum needs; the last fit takes all.
_SEARCH_POINTS = 24
_SEARCH_EVALUATIONS = 60
# Two ends of the search are the same minimum when they are this near; one that fits almost as well is a rival.
_SAME_DEG = 2.0
_RIVAL_RATIO = 1.5


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


@dataclass(frozen=True, eq=False)
class ProbeCalibration:
    """Where the probe is on the flange.

    Attributes:
        T_FS: The probe on the flange, `(4, 4)`.
        centre_B_mm: The reference sphere's centre in the base, `(3,)`.
        residuals_mm: `(m,)` height of each point above the sphere.
        rms_mm: Their root mean square.
        uncertainty_mm: Standard deviation of the worst of T_FS's three coordinates.
        uncertainty_deg: The same of its three angles.
        starts: From how many guesses the fit was searched for.
        wrong_starts: How many of them ended in a false minimum.
    """

    T_FS: FloatArray
    centre_B_mm: FloatArray
    residuals_mm: FloatArray
    rms_mm: float
    uncertainty_mm: float
    uncertainty_deg: float
    starts: int
    wrong_starts: int


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


def calibrate_probe(
    T_BF: FloatArray,
    points_S: Sequence[FloatArray],
    radius_mm: float,
    nominal_T_FS: FloatArray,
    greatest_rms_mm: float = 0.075,
) -> ProbeCalibration:
    """Return the probe's place on the flange from views of a sphere that stands still, of known radius.

    The points of all views must lie at the radius from one centre: |T_BF T_FS p - c| = r. Profiles of a sphere are
    circles, and a circle does not say on which side of it the centre is; so a single guess can end in a false minimum.
    The search starts from the nominal place turned into each of the 24 directions of a cube; the best end counts.

    Args:
        T_BF: Flange poses of the views, `(n, 4, 4)`.
        points_S: The points of each view, `(m, 3)` in frame S.
        radius_mm: The sphere's radius.
        nominal_T_FS: About where the probe is.
        greatest_rms_mm: A worse fit is refused; the default is three times the noise of the probe.

    Raises:
        CalibrationError: The views do not determine the place, or contradict each other.
    """
    _check_views(T_BF, points_S)
    thinned = _Views.of(T_BF, [view[:: max(1, len(view) // _SEARCH_POINTS)] for view in points_S])
    found = [_fit(thinned, radius_mm, guess, _SEARCH_EVALUATIONS) for guess in cube_turns(nominal_T_FS)]
    best = min(found, key=lambda end: end.rms_mm)
    fit = _fit(_Views.of(T_BF, points_S), radius_mm, best.T_FS)
    if fit.rms_mm > greatest_rms_mm:
        raise CalibrationError(
            f"the points lie {fit.rms_mm:.3f} mm (rms) off one sphere of radius {radius_mm:g} mm; allowed are"
            f" {greatest_rms_mm:g} mm: is this the sphere, did it move, is the probe where it is said to be?"
        )
    rival = _rival(found, best)
    if rival is not None:
        raise CalibrationError(
            f"the views fit two places of the probe equally well, {rival:.0f} deg apart;"
            " look at the sphere from more directions, off the middle of the line as well"
        )
    uncertainty_mm, uncertainty_deg = _uncertainty(fit)
    if not uncertainty_mm < 1.0:
        raise CalibrationError(
            f"the views leave the probe's place open by {uncertainty_mm:.1f} mm (1 sigma);"
            " look at the sphere from directions that differ more, and turn the probe about its beam as well"
        )
    wrong = sum(_apart_deg(end, best) > _SAME_DEG for end in found)
    return ProbeCalibration(
        fit.T_FS, fit.centre, fit.residuals, fit.rms_mm, uncertainty_mm, uncertainty_deg, len(found), wrong
    )


def _rival(found: Sequence["_Fit"], best: "_Fit") -> float | None:
    """Return how far (deg) another minimum is that fits as well as the best one, or None."""
    as_good = _RIVAL_RATIO * best.rms_mm + 1e-6
    rivals = (_apart_deg(end, best) for end in found if end.rms_mm < as_good)
    return max((apart for apart in rivals if apart > _SAME_DEG), default=None)


def _apart_deg(one: "_Fit", other: "_Fit") -> float:
    return float(np.degrees(Rotation.from_matrix(one.T_FS[:3, :3].T @ other.T_FS[:3, :3]).magnitude()))


def cube_turns(T_FS: FloatArray) -> Iterator[FloatArray]:
    """Yield T_FS `(4, 4)` turned into the 24 directions of a cube, itself first."""
    for axes, signs in product(permutations(range(3)), product((1.0, -1.0), repeat=3)):
        R = np.eye(3)[list(axes)] * signs
        if np.linalg.det(R) > 0.0:
            turned = T_FS.copy()
            turned[:3, :3] = T_FS[:3, :3] @ R
            yield turned


def sphere_centre(points: FloatArray, radius_mm: float) -> FloatArray:
    """Return the centre `(3,)` of a sphere of known radius through points `(m, 3)`, by least squares."""
    # |p|^2 = 2 p.c + (r^2 - |c|^2) is linear and gives the start.
    design = np.column_stack((2.0 * points, np.ones(len(points))))
    start = np.linalg.lstsq(design, np.sum(points**2, axis=1), rcond=None)[0][:3]

    def heights(centre: FloatArray) -> FloatArray:
        return np.asarray(np.linalg.norm(points - centre, axis=1) - radius_mm)

    return np.asarray(least_squares(heights, start).x)


def _check_views(T_BF: FloatArray, points_S: Sequence[FloatArray]) -> None:
    if len(T_BF) != len(points_S) or len(T_BF) < _FEWEST_POSES:
        raise CalibrationError(
            f"there are {len(T_BF)} flange poses and {len(points_S)} views of the sphere;"
            f" the probe's place needs as many of either, and at least {_FEWEST_POSES}"
        )
    short = [number for number, view in enumerate(points_S, 1) if len(view) < 3]
    if short:
        raise CalibrationError(f"view {short[0]} of the sphere has fewer than 3 points; look at it anew")


@dataclass(frozen=True, eq=False)
class _Views:
    """The points of all views, one row each, with the flange pose of their view."""

    R: FloatArray
    t: FloatArray
    points: FloatArray

    @classmethod
    def of(cls, T_BF: FloatArray, points_S: Sequence[FloatArray]) -> "_Views":
        view = np.repeat(np.arange(len(T_BF)), [len(points) for points in points_S])
        return cls(T_BF[view, :3, :3], T_BF[view, :3, 3], np.concatenate(list(points_S)))


@dataclass(frozen=True, eq=False)
class _Fit:
    T_FS: FloatArray
    centre: FloatArray
    residuals: FloatArray
    jacobian: FloatArray

    @property
    def rms_mm(self) -> float:
        return float(np.sqrt(np.mean(self.residuals**2)))


def _fit(views: _Views, radius_mm: float, guess: FloatArray, evaluations: int | None = None) -> _Fit:
    """Return where the nine unknowns come to from a guess of T_FS: turn (rad) and shift of the probe, sphere centre."""

    def placed(unknown: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the points turned as they are on the flange, before the probe's shift; and in the base."""
        turned = views.points @ (Rotation.from_rotvec(unknown[:3]).as_matrix() @ guess[:3, :3]).T
        in_base = np.einsum("nij,nj->ni", views.R, turned + unknown[3:6]) + views.t
        return turned, in_base

    def residuals(unknown: FloatArray) -> FloatArray:
        return np.asarray(np.linalg.norm(placed(unknown)[1] - unknown[6:], axis=1) - radius_mm)

    def jacobian(unknown: FloatArray) -> FloatArray:
        turned, in_base = placed(unknown)
        radial = in_base - unknown[6:]
        radial /= np.linalg.norm(radial, axis=1, keepdims=True)
        on_flange = np.einsum("nji,nj->ni", views.R, radial)
        turning = np.cross(turned, on_flange) @ _left_jacobian(unknown[:3])
        return np.column_stack((turning, on_flange, -radial))

    in_base = placed(np.concatenate((np.zeros(3), guess[:3, 3], np.zeros(3))))[1]
    start = np.concatenate((np.zeros(3), guess[:3, 3], in_base.mean(axis=0)))
    end = least_squares(residuals, start, jacobian, method="lm", max_nfev=evaluations)
    T_FS = np.eye(4)
    T_FS[:3, :3] = Rotation.from_rotvec(end.x[:3]).as_matrix() @ guess[:3, :3]
    T_FS[:3, 3] = end.x[3:6]
    return _Fit(T_FS, end.x[6:], end.fun, np.asarray(end.jac))


def _left_jacobian(turn: FloatArray) -> FloatArray:
    """Return how a small change of a rotation vector turns what it has turned (the left Jacobian of SO(3))."""
    angle = float(np.linalg.norm(turn))
    x, y, z = turn
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    if angle < 1e-6:
        return np.eye(3) + 0.5 * K
    first, second = (1.0 - np.cos(angle)) / angle**2, (angle - np.sin(angle)) / angle**3
    return np.asarray(np.eye(3) + first * K + second * K @ K)


def _uncertainty(fit: _Fit) -> tuple[float, float]:
    """Return the standard deviations of the worst coordinate (mm) and the worst angle (deg) of T_FS."""
    freedom = max(1, len(fit.residuals) - fit.jacobian.shape[1])
    variance = float(np.sum(fit.residuals**2)) / freedom
    try:
        covariance = variance * np.linalg.inv(fit.jacobian.T @ fit.jacobian)
    except np.linalg.LinAlgError:
        return np.inf, np.inf
    deviations = np.sqrt(np.abs(np.diag(covariance)))
    return float(deviations[3:6].max()), float(np.degrees(deviations[:3].max()))
