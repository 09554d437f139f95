"""Find the probe's pose on the flange with a fixed reference sphere: all its points are on one sphere.

A fit that is not plausible is refused; the message states the figure.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import permutations, product

import numpy as np
from scipy import stats
from scipy.spatial.transform import Rotation

from planner.arrays import FloatArray
from planner.scanning.calibration import GREATEST_POINT_ERROR_MM, CalibrationError, check_noise
from planner.scanning.probe_fit import CENTER, RADIUS, SHIFT, TURN, ProbeFit, Views, fit_heights, fit_rays
from planner.scanning.score_tests import FALSE_ALARMS, Change, NormalEquations, find_change

# The minimum that determines a pose and its uncertainty.
_FEWEST_POSES = 6
# Points per view for the search of the right minimum; the last fit uses all points.
_SEARCH_POINTS = 24
# Two results of the search this near to each other are the same minimum. Another one that fits almost as well is
# ambiguous.
_SAME_DEG, _SAME_MM = 2.0, 2.0
_RIVAL_RATIO = 1.5
# A view of a sphere is at most as wide as the sphere; one much smaller than this share of it has another unit.
_WIDEST, _NARROWEST = 2.2, 0.02
# Depth of the point for which the uncertainty is computed: the middle of the probe's range.
_DEPTH_MM = 150.0
# A radius with a larger uncertainty from the views is not checked.
_GREATEST_RADIUS_UNCERTAINTY_MM = 0.05
# Three tests share the allowed false alarms: of all residuals together, of the radius, and of their order.
_ALARMS_EACH = FALSE_ALARMS / 3.0


@dataclass(frozen=True, eq=False)
class ProbeCalibration:
    """The pose of the probe on the flange.

    Attributes:
        T_FS: the pose, `(4, 4)`.
        center_B_mm: center of the reference sphere in the base, `(3,)`.
        residuals_mm: `(m,)` height of each point above the sphere.
        rms_mm: their root mean square.
        noise_ratio: root of chi-square over its degrees of freedom: the residual in units of the probe's noise.
        fitted_radius_mm: radius of the sphere from the same views.
        radius_uncertainty_mm: its standard deviation.
        uncertainty_mm: expected distance (root mean square) of the origin of T_FS from its true position.
        uncertainty_deg: expected angle (root mean square) between the axes of T_FS and the true ones.
        point_error_mm: root mean square of the displacement of a point in the middle of the probe's range by both
            together.
        starts: number of initial guesses of the search.
        wrong_starts: number of guesses that ended in a false minimum.
    """

    T_FS: FloatArray
    center_B_mm: FloatArray
    residuals_mm: FloatArray
    rms_mm: float
    noise_ratio: float
    fitted_radius_mm: float
    radius_uncertainty_mm: float
    uncertainty_mm: float
    uncertainty_deg: float
    point_error_mm: float
    starts: int
    wrong_starts: int


def calibrate_probe(
    T_BF: FloatArray,
    points_S: Sequence[FloatArray],
    radius_mm: float,
    nominal_T_FS: FloatArray,
    noise_mm: float = 0.025,
    radius_tolerance_mm: float = 0.002,
) -> ProbeCalibration:
    """Return the probe's pose on the flange from views of a fixed sphere of known radius.

    The points of all views must have the distance of the radius from one center: |T_BF T_FS p - c| = r. Profiles of a
    sphere are circles, and a circle does not determine on which side of it the center is. So a single guess can end in
    a false minimum. The search starts from the nominal pose rotated into each of the 24 directions of a cube; the best
    result is used.

    The last fit is the maximum-likelihood fit for noise along the rays. Its residuals are tested. All of them are
    compared with the noise (chi-square). The best radius is compared with the given one. Their order shows whether a
    sphere or a probe moved, drifted, or was at another position in one view. Valid data are refused once in 1000 times.
    The arm is assumed to be exact.

    Args:
        T_BF: flange poses of the views, `(n, 4, 4)`, in the order of the measurements.
        points_S: points of each view, `(m, 3)` in frame S.
        radius_mm: radius of the sphere.
        nominal_T_FS: approximate pose of the probe.
        noise_mm: standard deviation of a point along its ray.
        radius_tolerance_mm: standard deviation of the sphere's radius, from its certificate.

    Raises:
        CalibrationError: the views do not determine the pose, or are inconsistent.
    """
    _check_views(T_BF, points_S, radius_mm)
    check_noise(noise_mm)
    thinned = Views.of(T_BF, [view[:: max(1, len(view) // _SEARCH_POINTS)] for view in points_S])
    found = [fit_heights(thinned, radius_mm, guess) for guess in cube_turns(nominal_T_FS)]
    best = min(found, key=lambda end: end.rms_mm)
    mirrored = _beyond_the_plane(thinned, best)
    found.append(fit_heights(thinned, radius_mm, mirrored, best.center))
    views = Views.of(T_BF, points_S)
    fit = fit_rays(views, best, noise_mm)
    free = fit_rays(views, fit, noise_mm, radius_is_known=False)
    radius_uncertainty_mm = float(np.sqrt(_covariance(free)[RADIUS, RADIUS].item()))
    # The likelihood ratio, reduced by the tolerance of the certificate.
    known_share = 1.0 / (1.0 + (radius_tolerance_mm / radius_uncertainty_mm) ** 2)
    radius_score = known_share * (fit.chi_square - free.chi_square)
    ratio = _check_residuals(views, fit, free.radius_mm, radius_score)
    rival = _rival(found, best)
    if rival is not None:
        raise CalibrationError(
            f"the views fit two places of the probe equally well, {rival};"
            " look at the sphere from more directions, off the middle of the line and on both sides of it as well"
        )
    covariance = max(1.0, ratio**2) * _covariance(fit)
    uncertainty_mm, uncertainty_rad = (float(np.sqrt(np.trace(covariance[each, each]))) for each in (SHIFT, TURN))
    point_error_mm = _point_error_mm(fit, covariance)
    if not point_error_mm <= GREATEST_POINT_ERROR_MM:
        raise CalibrationError(
            f"the views leave the probe's pose open by {uncertainty_mm:.2g} mm and"
            f" {np.degrees(uncertainty_rad):.2g} deg (1 sigma), which moves a point by {point_error_mm:.2g} mm;"
            f" allowed are {GREATEST_POINT_ERROR_MM:g} mm; measure the sphere from more different directions, and"
            " rotate the probe around its beam as well"
        )
    if not radius_uncertainty_mm <= _GREATEST_RADIUS_UNCERTAINTY_MM:
        raise CalibrationError(
            f"the views give the sphere's radius only to {radius_uncertainty_mm:.2g} mm (1 sigma), too little to check"
            f" whether it is {radius_mm:g} mm; move the line over the sphere in more steps"
        )
    return ProbeCalibration(
        T_FS=fit.T_FS,
        center_B_mm=fit.center,
        residuals_mm=fit.heights_mm,
        rms_mm=fit.rms_mm,
        noise_ratio=ratio,
        fitted_radius_mm=free.radius_mm,
        radius_uncertainty_mm=radius_uncertainty_mm,
        uncertainty_mm=uncertainty_mm,
        uncertainty_deg=float(np.degrees(uncertainty_rad)),
        point_error_mm=point_error_mm,
        starts=len(found),
        wrong_starts=sum(_are_apart(end, best) for end in found),
    )


def _check_residuals(views: Views, fit: ProbeFit, free_radius_mm: float, radius_score: float) -> float:
    """Refuse residuals that are not the probe's noise; return them in units of that noise.

    A sphere of another size and a sphere that moved are compared; the better explanation is named.
    """
    equations = NormalEquations.of(fit.residuals, fit.jacobian, views.view)
    ratio = float(np.sqrt(equations.chi_square / max(1, equations.freedom)))
    off = f"the points lie {fit.rms_mm:.3f} mm (rms) off one sphere of radius {fit.radius_mm:g} mm"
    change = find_change(equations, CENTER, _ALARMS_EACH, noise_is_known=True)
    if stats.chi2.sf(radius_score, 1) < _ALARMS_EACH and (change is None or radius_score > change.statistic):
        raise CalibrationError(
            f"{off}, and fit one of {free_radius_mm:.3f} mm better;"
            " check that this is the sphere, and that its radius is in mm"
        )
    if change is not None:
        raise CalibrationError(f"{off}, and {_what_changed(change)}")
    if stats.chi2.sf(equations.chi_square, max(1, equations.freedom)) < _ALARMS_EACH:
        raise CalibrationError(
            f"{off}, {ratio:.2f} times the probe's noise; check that this is the sphere, that it did not move,"
            " the nominal pose of the probe, and the given noise"
        )
    return ratio


def _what_changed(change: Change) -> str:
    if change.kind == "drift":
        return "the sphere drifts from view to view; check that it did not move, and that the cell is warm"
    if change.kind == "step":
        return f"the position of the sphere changes at view {change.group + 1}; check that it did not move"
    return f"view {change.group + 1} does not agree with the others; check the sphere and the flange pose"


def _beyond_the_plane(views: Views, fit: ProbeFit) -> FloatArray:
    """Return T_FS shifted so that the sphere is at the same distance on the other side of the laser's plane.

    If the line always passes the sphere on the same side, that pose fits as well.
    """
    in_F = np.einsum("nji,nj->ni", views.R, fit.center - views.t)
    aside_mm = float(np.mean((in_F - fit.T_FS[:3, 3]) @ fit.T_FS[:3, 1]))
    mirrored = fit.T_FS.copy()
    mirrored[:3, 3] += 2.0 * aside_mm * fit.T_FS[:3, 1]
    return mirrored


def _rival(found: Sequence[ProbeFit], best: ProbeFit) -> str | None:
    """Return the distance of another minimum that fits as well as the best one, or None."""
    as_good = _RIVAL_RATIO * best.rms_mm + 1e-6
    rivals = [_apart(end, best) for end in found if end.rms_mm < as_good and _are_apart(end, best)]
    if not rivals:
        return None
    angle_deg, distance_mm = max(rivals)
    return f"{angle_deg:.0f} deg apart" if angle_deg > _SAME_DEG else f"{distance_mm:.1f} mm apart"


def _apart(one: ProbeFit, other: ProbeFit) -> tuple[float, float]:
    """Return the distance of two placements: angle (deg) and distance (mm)."""
    turn = Rotation.from_matrix(one.T_FS[:3, :3].T @ other.T_FS[:3, :3])
    return float(np.degrees(turn.magnitude())), float(np.linalg.norm(one.T_FS[:3, 3] - other.T_FS[:3, 3]))


def _are_apart(one: ProbeFit, other: ProbeFit) -> bool:
    angle_deg, distance_mm = _apart(one, other)
    return angle_deg > _SAME_DEG or distance_mm > _SAME_MM


def cube_turns(T_FS: FloatArray) -> Iterator[FloatArray]:
    """Yield T_FS `(4, 4)` rotated into the 24 directions of a cube, itself first."""
    for axes, signs in product(permutations(range(3)), product((1.0, -1.0), repeat=3)):
        R = np.eye(3)[list(axes)] * signs
        if np.linalg.det(R) > 0.0:
            turned = T_FS.copy()
            turned[:3, :3] = T_FS[:3, :3] @ R
            yield turned


def _check_views(T_BF: FloatArray, points_S: Sequence[FloatArray], radius_mm: float) -> None:
    if len(T_BF) != len(points_S) or len(T_BF) < _FEWEST_POSES:
        raise CalibrationError(
            f"there are {len(T_BF)} flange poses and {len(points_S)} views of the sphere;"
            f" the probe's pose needs equal numbers of both, and at least {_FEWEST_POSES}"
        )
    short = [number for number, view in enumerate(points_S, 1) if len(view) < 3]
    if short:
        raise CalibrationError(f"view {short[0]} of the sphere has fewer than 3 points; measure it again")
    if not (np.isfinite(T_BF).all() and all(np.isfinite(view).all() for view in points_S)):
        raise CalibrationError("a flange pose or a point of the sphere is not a finite number")
    width_mm = float(np.median([np.linalg.norm(np.ptp(view, axis=0)) for view in points_S]))
    if not _NARROWEST * radius_mm < width_mm < _WIDEST * radius_mm:
        raise CalibrationError(
            f"the views of the sphere are {width_mm:.3g} wide, and its radius is {radius_mm:g};"
            " points, flange poses and radius must all be in mm"
        )


def _covariance(fit: ProbeFit) -> FloatArray:
    """Return the covariance of the unknowns; infinity if the views do not determine them."""
    information = fit.jacobian.T @ fit.jacobian
    with np.errstate(divide="ignore", invalid="ignore"):
        scale = 1.0 / np.sqrt(np.diag(information))
        scaled = information * scale * scale[:, np.newaxis]
    if not np.isfinite(scaled).all() or np.linalg.cond(scaled) > 1e13:
        return np.full_like(information, np.inf)
    return np.asarray(np.linalg.inv(scaled) * scale * scale[:, np.newaxis])


def _point_error_mm(fit: ProbeFit, covariance: FloatArray) -> float:
    """Return the displacement (rms, 1 sigma) of a point in the middle of the probe's range by the uncertainty."""
    x, y, z = _DEPTH_MM * fit.T_FS[:3, 2]
    turning = np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])
    moves = np.column_stack((turning, np.eye(3)))
    return float(np.sqrt(np.trace(moves @ covariance[:6, :6] @ moves.T)))
