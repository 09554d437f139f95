"""Join two clouds of one part that overlap: find the pose of the second in the frame of the first, or why not.

Generalized ICP (Segal, Haehnel and Thrun, 2009) by small_gicp, from many first guesses, so that a second pose that
fits as well is found. Two things decide: the overlap, points of the second cloud that have a point of the first one
near, with the same normal; and contradictions, points of one cloud in space that the laser passed for the other one.
The pose is refused where the overlap is too small, and where it leaves a motion free (a cylinder about its own axis).
It is refused, too, where another pose fits as well (a symmetric part).
"""

from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from planner.adaptive.coarse_alignment import CoarseAlignment
from planner.adaptive.registration_cloud import Cloud
from planner.adaptive.voxel_map import FREE, VoxelMap
from planner.arrays import BoolArray, FloatArray
from planner.geometry.transforms import rigid_inverse, rotations_z

_COARSE_POINTS = 1500
"""Points of a cloud, about, when guesses are tried."""
_GUESSES, _YAW_STEP_DEG = 72, 30.0
_REFINED, _HOPEFUL_SHARE = 6, 0.6
"""Poses that are refined at most, and what share of the largest overlap makes one hopeful."""
_FEWEST_POINTS = 100
_FAR_SHARE, _NEAR_CELLS = 0.15, 1.5
"""How far correspondences are looked for: of the part's size at first, and in cells of the clouds in the end."""
_SAME_NORMAL = 0.8
_SIGMA = 1.4826
"""Standard deviation over median absolute deviation of a normal distribution."""
_CONTRADICTION = 2.0
"""How many overlapping points one that contradicts outweighs."""
_MOST_CONTRADICTED = 0.1
_FEWEST_SHARE = 0.15
"""Of the smaller cloud, that must overlap."""
_RIVAL_SHARE, _RIVAL_RESIDUAL, _RIVAL_MORE = 0.85, 1.5, 0.03
"""Another pose fits as well when it has this share of the overlap, this ratio of the residual, and so many more
contradictions."""
_OTHER_DEG, _OTHER_SHARE = 4.0, 0.02
"""How far two poses of the part are apart to be two: by rotation, or by a share of its size."""
_WEAKEST = 0.03
"""How much the surface must resist each motion: root mean square motion across the surface for 1 mm."""
_PATCH_MM = 5.0
"""Errors of the alignment are the same within such a distance (an estimate): they do not average out as noise does."""
_MOST_UNCERTAIN_MM = 0.05


class Overlap(NamedTuple):
    """Where two clouds have each other near.

    Attributes:
        share: Of the smaller cloud's points, that have one of the other cloud near, with the same normal.
        contradicted: Of both clouds' points, the share that lies where the laser passed for the other cloud.
        residual_mm: Distance of these from the other's surface, 1 sigma, from the median: edges do not count.
        points: `(m, 3)` these points.
        normals: `(m, 3)` the other surface's normals there.
    """

    share: float
    contradicted: float
    residual_mm: float
    points: FloatArray
    normals: FloatArray

    @property
    def worth(self) -> float:
        """How well the pose fits."""
        return self.share - _CONTRADICTION * self.contradicted


class Joined(NamedTuple):
    """The pose of the second cloud.

    Attributes:
        T_12: `(4, 4)` takes the second cloud to the frame of the first.
        overlap: Where they have each other near.
        weakest: How much the surface resists the motion that it resists least; 1 where all of it is in the way.
        uncertainty_mm: 1 sigma of a point's place at the part's ends (an estimate).
    """

    T_12: FloatArray
    overlap: Overlap
    weakest: float
    uncertainty_mm: float


def join(first: Cloud, second: Cloud, about_12: FloatArray) -> Joined | str:
    """Return the pose of the second cloud in the frame of the first, or why the clouds do not determine it.

    Args:
        first: The cloud that stays.
        second: The cloud whose pose is looked for.
        about_12: `(4, 4)` about how it is turned; where this is far off, the right pose may not be found.
    """
    size_mm = max(first.size_mm(), second.size_mm())
    if min(len(first.points), len(second.points)) < _FEWEST_POINTS:
        return f"a cloud has {min(len(first.points), len(second.points))} points; {_FEWEST_POINTS} are needed"
    coarse_mm = max(_coarse_cell_mm(first), _coarse_cell_mm(second))
    coarse, fine = _Pair(first.thinned(coarse_mm), second.thinned(coarse_mm)), _Pair(first, second)
    guess = CoarseAlignment(coarse.first, _FAR_SHARE * size_mm)
    found = [guess.aligned(coarse.second, T) for T in _guesses(coarse.first, coarse.second, about_12)]
    poses = [T for _, T in _best_first(coarse, _different(found, coarse, size_mm))]
    judged = _best_first(fine, [fine.aligned(T, (2.0 * coarse_mm, first.cell_mm)) for T in poses])
    best, T_12 = judged[0]
    fault = _fault(best, size_mm) or _rivalry(judged, second, size_mm)
    if fault is not None:
        return fault
    weakest = _weakest(best, size_mm)
    uncertainty_mm = best.residual_mm / (weakest * np.sqrt(len(best.points)) * first.cell_mm / _PATCH_MM)
    if uncertainty_mm > _MOST_UNCERTAIN_MM:
        return (
            f"the overlap is too small to determine the pose: its uncertainty is {uncertainty_mm:.2f} mm, and"
            f" {_MOST_UNCERTAIN_MM:g} mm are allowed"
        )
    return Joined(T_12, best, weakest, float(uncertainty_mm))


def _fault(best: Overlap, size_mm: float) -> str | None:
    """Return why an overlap does not determine a pose, or None."""
    if best.share < _FEWEST_SHARE:
        return f"the clouds overlap by {best.share:.0%} of the smaller one; at least {_FEWEST_SHARE:.0%} are needed"
    if best.contradicted > _MOST_CONTRADICTED:
        return (
            f"no pose was found in which the clouds agree: in the best one, {best.contradicted:.0%} of the points lie"
            " where the laser passed for the other cloud"
        )
    weakest = _weakest(best, size_mm)
    if weakest < _WEAKEST:
        return (
            f"the overlap leaves a motion free: in its weakest direction the surface resists by {weakest:.1%}, and at"
            f" least {_WEAKEST:.0%} are needed; a part that is round or straight has no pose of its own"
        )
    return None


def _rivalry(judged: list[tuple[Overlap, FloatArray]], second: Cloud, size_mm: float) -> str | None:
    """Return which other pose fits as well as the first one of all, or None."""
    best, T_12 = judged[0]
    for other, T in judged[1:]:
        fits = other.share > _RIVAL_SHARE * best.share and other.contradicted < best.contradicted + _RIVAL_MORE
        fits &= other.residual_mm < _RIVAL_RESIDUAL * best.residual_mm
        if fits and _are_apart(T, T_12, second, size_mm):
            return (
                f"another pose fits as well, turned by {_apart(T, T_12, second)[0]:.0f} deg (overlap {other.share:.0%}"
                f" against {best.share:.0%}): the part is symmetric as far as it was seen"
            )
    return None


class _Pair:
    """Two clouds, prepared to be aligned repeatedly."""

    def __init__(self, first: Cloud, second: Cloud) -> None:
        import small_gicp  # noqa: PLC0415  # an extra: only who joins clouds needs it

        self.first, self.second = first, second
        self._align = small_gicp.align
        self._target, self._source = small_gicp.PointCloud(first.points), small_gicp.PointCloud(second.points)
        for cloud in (self._target, self._source):
            small_gicp.estimate_covariances(cloud)
        self._free = first.free_space(), second.free_space()
        self._target_tree, self._tree = small_gicp.KdTree(self._target), cKDTree(first.points)

    def aligned(self, T_12: FloatArray, reaches_mm: tuple[float, ...]) -> FloatArray:
        """Return the pose to which generalized ICP comes, with correspondences ever nearer."""
        for reach_mm in reaches_mm:
            T_12 = self._align(
                self._target, self._source, self._target_tree, T_12, registration_type="GICP",
                max_correspondence_distance=reach_mm, max_iterations=30,
                translation_epsilon=1e-4, rotation_epsilon=1e-6,
            ).T_target_source  # fmt: skip
        return np.asarray(T_12)

    def overlap(self, T_12: FloatArray) -> Overlap:
        """Return the overlap in a pose of the second cloud."""
        first, moved = self.first, self.second.moved(T_12)
        distances_mm, nearest = self._tree.query(moved.points, distance_upper_bound=_NEAR_CELLS * first.cell_mm)
        near, nearest = np.flatnonzero(np.isfinite(distances_mm)), np.asarray(nearest)
        near = near[np.einsum("ij,ij->i", moved.normals[near], first.normals[nearest[near]]) > _SAME_NORMAL]
        normals = first.normals[nearest[near]]
        across_mm = np.einsum("ij,ij->i", moved.points[near] - first.points[nearest[near]], normals)
        residual_mm = _SIGMA * float(np.median(np.abs(across_mm))) if len(near) else np.inf
        share = len(near) / min(len(first.points), len(moved.points))
        return Overlap(share, self._contradicted(T_12), residual_mm, moved.points[near], normals)

    def _contradicted(self, T_12: FloatArray) -> float:
        """Return the share of the points that lie where the laser passed for the other cloud."""
        T_21 = rigid_inverse(T_12)
        there, here = self.second.moved(T_12).points, self.first.moved(T_21).points
        passed = _passed(self._free[0], there), _passed(self._free[1], here)
        return (int(passed[0].sum()) + int(passed[1].sum())) / (len(there) + len(here))


def _passed(free: VoxelMap, points: FloatArray) -> BoolArray:
    """Return which points `(n, 3)` lie where the laser passed."""
    cells, inside = free.cells(points)
    passed = np.zeros(len(points), dtype=np.bool_)
    passed[inside] = ((free.states == FREE) & free.is_within)[tuple(cells[inside].T)]
    return passed


def _best_first(pair: _Pair, poses: list[FloatArray]) -> list[tuple[Overlap, FloatArray]]:
    """Return the poses that may be the right one, those that fit best first."""
    judged = sorted(((pair.overlap(T), T) for T in poses), key=lambda each: -each[0].worth)
    most = judged[0][0].worth
    return [each for each in judged if each[0].worth >= most - (1.0 - _HOPEFUL_SHARE) * abs(most)][:_REFINED]


def _guesses(first: Cloud, second: Cloud, about_12: FloatArray) -> list[FloatArray]:
    """Return the given pose, then poses turned from it about the vertical of the second cloud, then in every way.

    All but the first put the middles of both clouds on each other.
    """
    upright = rotations_z(np.arange(0.0, 360.0, _YAW_STEP_DEG))[:, :3, :3]
    every = Rotation.random(_GUESSES, rng=np.random.default_rng(0)).as_matrix()
    rotations = about_12[:3, :3] @ np.concatenate((upright, every))
    middle, other = (0.5 * (cloud.points.min(axis=0) + cloud.points.max(axis=0)) for cloud in (first, second))
    guesses = np.tile(np.eye(4), (len(rotations), 1, 1))
    guesses[:, :3, :3] = rotations
    guesses[:, :3, 3] = middle - rotations @ other
    return [about_12, *guesses]


def _coarse_cell_mm(cloud: Cloud) -> float:
    """Return the side of the cells that leave so many points of a cloud."""
    return float(cloud.cell_mm * np.sqrt(max(1.0, len(cloud.points) / _COARSE_POINTS)))


def _different(poses: list[FloatArray], pair: _Pair, size_mm: float) -> list[FloatArray]:
    """Return the poses without those that are the same as an earlier one."""
    kept: list[FloatArray] = []
    for T in poses:
        if all(_are_apart(T, other, pair.second, size_mm) for other in kept):
            kept.append(T)
    return kept


def _are_apart(T: FloatArray, other: FloatArray, cloud: Cloud, size_mm: float) -> bool:
    turn_deg, shift_mm = _apart(T, other, cloud)
    return turn_deg > _OTHER_DEG or shift_mm > _OTHER_SHARE * size_mm


def _apart(T: FloatArray, other: FloatArray, cloud: Cloud) -> tuple[float, float]:
    """Return by what two poses of a cloud differ: the angle in deg, and how far its middle moves in mm."""
    turn = Rotation.from_matrix(T[:3, :3] @ other[:3, :3].T).magnitude()
    middle = np.append(cloud.points.mean(axis=0), 1.0)
    return float(np.degrees(turn)), float(np.linalg.norm((T - other) @ middle))


def _weakest(found: Overlap, size_mm: float) -> float:
    """Return the RMS motion across the surface, of the rigid motion of 1 mm that the surface resists least.

    A rotation counts by how far it moves a place at half the part's size.
    """
    arms = found.points - found.points.mean(axis=0)
    rows = np.hstack((np.cross(arms, found.normals) / (0.5 * size_mm), found.normals))
    return float(np.sqrt(max(0.0, np.linalg.eigvalsh(rows.T @ rows / len(rows))[0])))
