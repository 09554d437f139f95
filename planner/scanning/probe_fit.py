"""The least-squares fit of the probe's pose on the flange: all points of all views are on one sphere."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from planner.arrays import FloatArray, IndexArray

# Beyond this incidence a sphere is not measured. A ray with a larger incidence, or one that misses, has the wrong
# sphere.
_LEAST_COSINE = 0.2
_SEARCH_EVALUATIONS = 60

TURN, SHIFT, CENTER, RADIUS = slice(0, 3), slice(3, 6), slice(6, 9), slice(9, 10)
"""The unknowns: rotation (rad) and shift (mm) of the probe on the flange, center and radius of the sphere (mm)."""


@dataclass(frozen=True, eq=False)
class Views:
    """The points of all views, one row each.

    Attributes:
        view: `(m,)` view of each point.
        R: `(m, 3, 3)` orientation of the flange in that view.
        t: `(m, 3)` position of the flange.
        points: `(m, 3)` in frame S.
    """

    view: IndexArray
    R: FloatArray
    t: FloatArray
    points: FloatArray

    @classmethod
    def of(cls, T_BF: FloatArray, points_S: Sequence[FloatArray]) -> "Views":
        """Return the views from flange poses `(n, 4, 4)` and the points of each."""
        view = np.repeat(np.arange(len(T_BF)), [len(points) for points in points_S])
        return cls(view, T_BF[view, :3, :3], T_BF[view, :3, 3], np.concatenate(list(points_S)))


@dataclass(frozen=True, eq=False)
class ProbeFit:
    """The result of a fit.

    Attributes:
        T_FS: pose of the probe on the flange, `(4, 4)`.
        center: center of the sphere in the base, `(3,)`.
        radius_mm: radius of the sphere, as given or as found.
        heights_mm: `(m,)` height of each point above the sphere.
        residuals: `(m,)` the minimized values: the heights, or the errors along the rays in units of the noise.
        jacobian: `(m, 9)` or `(m, 10)` derivatives of the residuals.
    """

    T_FS: FloatArray
    center: FloatArray
    radius_mm: float
    heights_mm: FloatArray
    residuals: FloatArray
    jacobian: FloatArray

    @property
    def rms_mm(self) -> float:
        """Root mean square of the heights."""
        return float(np.sqrt(np.mean(self.heights_mm**2)))

    @property
    def chi_square(self) -> float:
        """Sum of the squared residuals."""
        return float(np.sum(self.residuals**2))


class _Sphere:
    """The points of all views relative to a sphere, as functions of the unknowns."""

    def __init__(self, views: Views, guess: FloatArray, radius_mm: float | None) -> None:
        """Store the sphere's radius, or None if it is the tenth unknown."""
        self.lengths = np.linalg.norm(views.points, axis=1)
        self._views, self._guess, self._radius_mm = views, guess[:3, :3], radius_mm
        self._rays = views.points / self.lengths[:, np.newaxis]

    def radius_mm(self, unknown: FloatArray) -> float:
        return float(unknown[9]) if self._radius_mm is None else self._radius_mm

    def direction(self, unknown: FloatArray) -> FloatArray:
        """Return the orientation of S on the flange, `(3, 3)`."""
        return np.asarray(Rotation.from_rotvec(unknown[TURN]).as_matrix() @ self._guess)

    def in_base(self, unknown: FloatArray) -> FloatArray:
        on_flange = self._views.points @ self.direction(unknown).T + unknown[SHIFT]
        return np.asarray(np.einsum("nij,nj->ni", self._views.R, on_flange) + self._views.t)

    def heights(self, unknown: FloatArray) -> FloatArray:
        return np.asarray(np.linalg.norm(self.in_base(unknown) - unknown[CENTER], axis=1) - self.radius_mm(unknown))

    def distances(self, unknown: FloatArray) -> FloatArray:
        """Return the position along each ray at which it meets the sphere.

        If the ray misses, return about the nearest position.
        """
        center_F = np.einsum("nji,nj->ni", self._views.R, unknown[CENTER] - self._views.t)
        center_S = (center_F - unknown[SHIFT]) @ self.direction(unknown)
        along = np.einsum("ni,ni->n", center_S, self._rays)
        inside2 = self.radius_mm(unknown) ** 2 - np.einsum("ni,ni->n", center_S, center_S) + along**2
        return np.asarray(along - np.sqrt(np.maximum(inside2, (_LEAST_COSINE * self.radius_mm(unknown)) ** 2)))

    def height_slopes(self, unknown: FloatArray, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the derivatives of the heights of points in S by the unknowns, and along the rays, `(m,)`."""
        direction = self.direction(unknown)
        turned = points @ direction.T
        in_base = np.einsum("nij,nj->ni", self._views.R, turned + unknown[SHIFT]) + self._views.t
        radial = in_base - unknown[CENTER]
        radial /= np.linalg.norm(radial, axis=1, keepdims=True)
        on_flange = np.einsum("nji,nj->ni", self._views.R, radial)
        turning = np.cross(turned, on_flange) @ _left_jacobian(unknown[TURN])
        columns = [turning, on_flange, -radial]
        if self._radius_mm is None:
            columns.append(-np.ones((len(radial), 1)))
        along = np.einsum("ni,ni->n", on_flange @ direction, self._rays)
        return np.column_stack(columns), along

    def height_jacobian(self, unknown: FloatArray) -> FloatArray:
        return self.height_slopes(unknown, self._views.points)[0]

    def ray_jacobian(self, unknown: FloatArray) -> FloatArray:
        """Return the derivatives of measured minus modeled distances, by the implicit function |t u - c| = r."""
        met = self.distances(unknown)[:, np.newaxis] * self._rays
        slopes, along = self.height_slopes(unknown, met)
        return np.asarray(slopes / np.minimum(along, -_LEAST_COSINE)[:, np.newaxis])


def fit_heights(views: Views, radius_mm: float, guess: FloatArray, center: FloatArray | None = None) -> ProbeFit:
    """Return the result of a fast fit of the points' heights above the sphere, from a guess of T_FS.

    It converges from far away, but noise along an oblique ray shifts it a little: the square of the noise over the
    radius. `fit_rays` removes this shift.

    Args:
        views: the points.
        radius_mm: radius of the sphere.
        guess: initial T_FS.
        center: initial center of the sphere; default: the middle of the points.
    """
    sphere = _Sphere(views, guess, radius_mm)
    if center is None:
        center = sphere.in_base(np.concatenate((np.zeros(3), guess[:3, 3]))).mean(axis=0)
    start = np.concatenate((np.zeros(3), guess[:3, 3], center))
    end = least_squares(sphere.heights, start, sphere.height_jacobian, method="lm", max_nfev=_SEARCH_EVALUATIONS).x
    return _ended(sphere, end, sphere.heights(end), sphere.height_jacobian(end))


def fit_rays(views: Views, start: ProbeFit, noise_mm: float, radius_is_known: bool = True) -> ProbeFit:
    """Return the maximum-likelihood fit for noise along the rays, which start at the origin of S.

    Args:
        views: the points.
        start: an initial fit.
        noise_mm: standard deviation of a point along its ray.
        radius_is_known: whether the radius of `start` is fixed.
    """
    sphere = _Sphere(views, start.T_FS, start.radius_mm if radius_is_known else None)

    def residuals(unknown: FloatArray) -> FloatArray:
        return np.asarray((sphere.lengths - sphere.distances(unknown)) / noise_mm)

    def jacobian(unknown: FloatArray) -> FloatArray:
        return np.asarray(sphere.ray_jacobian(unknown) / noise_mm)

    unknown = [np.zeros(3), start.T_FS[:3, 3], start.center, np.full(0 if radius_is_known else 1, start.radius_mm)]
    end = least_squares(residuals, np.concatenate(unknown), jacobian, method="lm").x
    return _ended(sphere, end, residuals(end), jacobian(end))


def _ended(sphere: _Sphere, end: FloatArray, residuals: FloatArray, jacobian: FloatArray) -> ProbeFit:
    T_FS = np.eye(4)
    T_FS[:3, :3] = sphere.direction(end)
    T_FS[:3, 3] = end[SHIFT]
    return ProbeFit(T_FS, end[CENTER], sphere.radius_mm(end), sphere.heights(end), residuals, jacobian)


def _left_jacobian(turn: FloatArray) -> FloatArray:
    """Return the effect of a small change of a rotation vector on a rotated vector (the left Jacobian of SO(3))."""
    angle = float(np.linalg.norm(turn))
    x, y, z = turn
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    if angle < 1e-6:
        return np.eye(3) + 0.5 * K
    first, second = (1.0 - np.cos(angle)) / angle**2, (angle - np.sin(angle)) / angle**3
    return np.asarray(np.eye(3) + first * K + second * K @ K)
