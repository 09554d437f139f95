"""Find the probe's place on the flange from a reference sphere that stands still: all its points lie on one sphere.

A fit that is not plausible is refused, with the figure that says so.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import permutations, product

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from planner.arrays import FloatArray
from planner.scanning.calibration import CalibrationError

# The least that determines a place and says how well.
_FEWEST_POSES = 6
# Points a view that a search for the right minimum needs; the last fit takes all.
_SEARCH_POINTS = 24
_SEARCH_EVALUATIONS = 60
# Two ends of the search are the same minimum when they are this near; one that fits almost as well is a rival.
_SAME_DEG = 2.0
_RIVAL_RATIO = 1.5


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
