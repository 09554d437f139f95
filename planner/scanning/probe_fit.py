"""The least-squares fit of the probe's place on the flange: all points of all views lie on one sphere."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from planner.arrays import FloatArray, IndexArray

# At grazing incidence the noise along the ray hardly shows as height; the curvature of the sphere does.
_LEAST_COSINE = 0.2

TURN, SHIFT, CENTRE, RADIUS = slice(0, 3), slice(3, 6), slice(6, 9), slice(9, 10)
"""The unknowns: turn (rad) and shift (mm) of the probe on the flange, the sphere's centre and radius (mm)."""


@dataclass(frozen=True, eq=False)
class Views:
    """The points of all views, one row each.

    Attributes:
        view: `(m,)` which view each point belongs to.
        R: `(m, 3, 3)` direction of the flange in that view.
        t: `(m, 3)` where the flange is.
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
    """Where a fit ended.

    Attributes:
        T_FS: The probe on the flange, `(4, 4)`.
        centre: The sphere's centre in the base, `(3,)`.
        radius_mm: The sphere's radius, as given or as found.
        heights_mm: `(m,)` height of each point above the sphere.
        jacobian: `(m, 9)` or `(m, 10)` derivatives of the heights.
    """

    T_FS: FloatArray
    centre: FloatArray
    radius_mm: float
    heights_mm: FloatArray
    jacobian: FloatArray

    @property
    def rms_mm(self) -> float:
        """Root mean square of the heights."""
        return float(np.sqrt(np.mean(self.heights_mm**2)))


def fit_probe(
    views: Views,
    radius_mm: float,
    guess: FloatArray,
    centre: FloatArray | None = None,
    weights: FloatArray | None = None,
    radius_is_known: bool = True,
    evaluations: int | None = None,
) -> ProbeFit:
    """Return where the unknowns come to from a guess of T_FS.

    Args:
        views: The points.
        radius_mm: The sphere's radius; the start of the search where it is not known.
        guess: T_FS to start from.
        centre: The sphere's centre to start from; the middle of the points where left out.
        weights: `(m,)` 1 over each height's standard deviation; all alike where left out.
        radius_is_known: Whether the radius stays as given.
        evaluations: Largest number of evaluations.
    """
    weight = np.ones(len(views.points)) if weights is None else weights

    def placed(unknown: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the points turned as they are on the flange, before the probe's shift; and in the base."""
        turned = views.points @ (Rotation.from_rotvec(unknown[TURN]).as_matrix() @ guess[:3, :3]).T
        in_base = np.einsum("nij,nj->ni", views.R, turned + unknown[SHIFT]) + views.t
        return turned, in_base

    def heights(unknown: FloatArray) -> FloatArray:
        r = radius_mm if radius_is_known else unknown[9]
        return np.asarray(np.linalg.norm(placed(unknown)[1] - unknown[CENTRE], axis=1) - r)

    def weighted_heights(unknown: FloatArray) -> FloatArray:
        return weight * heights(unknown)

    def jacobian(unknown: FloatArray) -> FloatArray:
        turned, in_base = placed(unknown)
        radial = in_base - unknown[CENTRE]
        radial /= np.linalg.norm(radial, axis=1, keepdims=True)
        on_flange = np.einsum("nji,nj->ni", views.R, radial)
        turning = np.cross(turned, on_flange) @ _left_jacobian(unknown[TURN])
        columns = [turning, on_flange, -radial]
        return np.column_stack(columns if radius_is_known else [*columns, -np.ones(len(radial))])

    def weighted_jacobian(unknown: FloatArray) -> FloatArray:
        return weight[:, np.newaxis] * jacobian(unknown)

    if centre is None:
        centre = placed(np.concatenate((np.zeros(3), guess[:3, 3])))[1].mean(axis=0)
    start = [np.zeros(3), guess[:3, 3], centre, np.full(0 if radius_is_known else 1, radius_mm)]
    end = least_squares(weighted_heights, np.concatenate(start), weighted_jacobian, method="lm", max_nfev=evaluations).x
    T_FS = np.eye(4)
    T_FS[:3, :3] = Rotation.from_rotvec(end[TURN]).as_matrix() @ guess[:3, :3]
    T_FS[:3, 3] = end[SHIFT]
    return ProbeFit(
        T_FS,
        end[CENTRE],
        radius_mm if radius_is_known else float(end[9]),
        heights(end),
        jacobian(end),
    )


def cosines(views: Views, T_FS: FloatArray, centre: FloatArray) -> FloatArray:
    """Return the cosine `(m,)` between each point's ray and the sphere's radius there.

    Noise along the ray shows as height by this factor.
    """
    rays = views.points @ T_FS[:3, :3].T
    radial = np.einsum("nij,nj->ni", views.R, rays + T_FS[:3, 3]) + views.t - centre
    rays = np.einsum("nij,nj->ni", views.R, rays)
    lengths = np.linalg.norm(rays, axis=1) * np.linalg.norm(radial, axis=1)
    cosines = np.abs(np.einsum("ni,ni->n", rays, radial)) / np.maximum(lengths, 1e-12)
    return np.asarray(np.maximum(cosines, _LEAST_COSINE))


def _left_jacobian(turn: FloatArray) -> FloatArray:
    """Return how a small change of a rotation vector turns what it has turned (the left Jacobian of SO(3))."""
    angle = float(np.linalg.norm(turn))
    x, y, z = turn
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    if angle < 1e-6:
        return np.eye(3) + 0.5 * K
    first, second = (1.0 - np.cos(angle)) / angle**2, (angle - np.sin(angle)) / angle**3
    return np.asarray(np.eye(3) + first * K + second * K @ K)
