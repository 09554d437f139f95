"""Bring one cloud near to another from a bad guess: iterative closest points that are near in place and in normal.

The normals keep the two sides of a plate apart, which are near each other in place. The distance to be made small is
that from the planes of the other cloud's points (Chen and Medioni, 1992).
"""

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from planner.adaptive.registration_cloud import Cloud
from planner.arrays import FloatArray

_ITERATIONS = 25
_MOST_POINTS = 500
"""Of the moving cloud, that are looked at."""
_FEWEST = 12


class CoarseAlignment:
    """A cloud that others are aligned with."""

    def __init__(self, first: Cloud, far_mm: float) -> None:
        """Prepare a cloud; correspondences are looked for within `far_mm` at first."""
        self._first, self._far_mm = first, far_mm
        # A normal that is turned by 60 deg counts as a place that is as far as the farthest correspondence.
        self._tree = cKDTree(np.hstack((first.points, far_mm * first.normals)))

    def aligned(self, second: Cloud, T_12: FloatArray) -> FloatArray:
        """Return the pose to which the second cloud comes from `T_12` `(4, 4)`."""
        some = second.every(max(1, len(second.points) // _MOST_POINTS))
        last_mm = 2.0 * self._first.cell_mm
        for reach_mm in np.geomspace(max(self._far_mm, last_mm), last_mm, _ITERATIONS):
            moved = some.moved(T_12)
            place = np.hstack((moved.points, self._far_mm * moved.normals))
            distances_mm, nearest = self._tree.query(place, distance_upper_bound=reach_mm)
            near, nearest = np.flatnonzero(np.isfinite(distances_mm)), np.asarray(nearest)
            if len(near) < _FEWEST:
                break
            to, normals = self._first.points[nearest[near]], self._first.normals[nearest[near]]
            T_12 = _step(moved.points[near], to, normals) @ T_12
        return T_12


def _step(points: FloatArray, to: FloatArray, normals: FloatArray) -> FloatArray:
    """Return the small motion `(4, 4)` of points `(n, 3)` that brings them nearest to planes."""
    middle = points.mean(axis=0)
    arms = points - middle
    size_mm = float(np.abs(arms).max()) or 1.0
    rows = np.hstack((np.cross(arms / size_mm, normals), normals))
    across = np.einsum("ij,ij->i", to - points, normals)
    # A little damping keeps motions that the surface does not resist at 0.
    solution = np.linalg.solve(rows.T @ rows + 1e-6 * len(rows) * np.eye(6), rows.T @ across)
    T = np.eye(4)
    T[:3, :3] = Rotation.from_rotvec(solution[:3] / size_mm).as_matrix()
    T[:3, 3] = middle + solution[3:] - T[:3, :3] @ middle
    return T
