"""The surface as far as it was seen, estimated from the noisy points alone: normals, shadows, and where it ends."""

from functools import cached_property
from typing import NamedTuple

import numpy as np
import trimesh
from scipy.spatial import cKDTree

from planner.arrays import FloatArray, IndexArray
from planner.geometry.point_normals import point_normals
from planner.geometry.ray_casting import RayCaster
from planner.geometry.thinned_cloud import ThinnedCloud

# In cells of the thinned cloud: how far neighbors are looked for, and half the side of the square that stands for a
# point when shadows are cast; squares of neighbors overlap.
_NEIGHBORS_CELLS = 2.5
_HALF_SQUARE_CELLS = 0.75
_NEIGHBORS = 24
_GAP_RAD = np.radians(110.0)
"""Angle about a point without a neighbor from which on the surface ends there."""


class Rim(NamedTuple):
    """Where the seen surface ends.

    Attributes:
        points: `(n, 3)` in frame W, in mm.
        normals: `(n, 3)` of the surface there.
        outward: `(n, 3)` unit vectors along the surface, away from what was seen.
    """

    points: FloatArray
    normals: FloatArray
    outward: FloatArray


class Estimate:
    """The seen surface at one moment.

    Attributes:
        points: `(n, 3)` in frame W, one for each cell, in mm.
        normals: `(n, 3)` of length 1.
    """

    def __init__(self, cloud: ThinnedCloud) -> None:
        """Estimate the surface of a cloud."""
        radius_mm = _NEIGHBORS_CELLS * cloud.cell_mm
        found = point_normals(cloud.points, cloud.beams, radius_mm)
        self.points: FloatArray = cloud.points[found.is_known]
        self.normals: FloatArray = found.normals[found.is_known]
        self._cell_mm, self._radius_mm = cloud.cell_mm, radius_mm

    @cached_property
    def tree(self) -> cKDTree:
        """The points, for questions about neighbors."""
        return cKDTree(self.points)

    @cached_property
    def caster(self) -> RayCaster:
        """The surface as overlapping squares, for rays."""
        along, across = _tangents(self.normals)
        half_mm = _HALF_SQUARE_CELLS * self._cell_mm
        corners = np.array(((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))) * half_mm
        vertices = self.points[:, None] + corners[:, :1] * along[:, None] + corners[:, 1:] * across[:, None]
        first = 4 * np.arange(len(self.points))[:, None, None]
        faces = (first + np.array(((0, 1, 2), (0, 2, 3)))).reshape(-1, 3)
        return RayCaster(trimesh.Trimesh(vertices.reshape(-1, 3), faces, process=False))

    @cached_property
    def rim(self) -> Rim:
        """Where the surface ends: points with no neighbor in a wide angle about them."""
        along, across = _tangents(self.normals)
        _, neighbours = self.tree.query(self.points, k=_NEIGHBORS + 1, distance_upper_bound=self._radius_mm)
        neighbours = np.asarray(neighbours)[:, 1:]
        found = neighbours < len(self.points)
        neighbours = np.where(found, neighbours, 0)
        found &= np.einsum("ijk,ik->ij", self.normals[neighbours], self.normals) > 0.0
        to = self.points[neighbours] - self.points[:, np.newaxis]
        angles = np.arctan2(np.einsum("ijk,ik->ij", to, across), np.einsum("ijk,ik->ij", to, along))
        # Places without a neighbor repeat an angle that there is, and leave no gap.
        first = np.take_along_axis(angles, found.argmax(axis=1)[:, np.newaxis], axis=1)
        angles = np.sort(np.where(found, angles, first), axis=1)
        gaps = np.diff(angles, axis=1, append=angles[:, :1] + 2.0 * np.pi)
        widest = gaps.argmax(axis=1)
        row = np.arange(len(self.points))
        at = (gaps[row, widest] > _GAP_RAD) & found.any(axis=1)
        middle = (angles[row, widest] + 0.5 * gaps[row, widest])[at, np.newaxis]
        outward = np.cos(middle) * along[at] + np.sin(middle) * across[at]
        return Rim(self.points[at], self.normals[at], outward)


def _tangents(normals: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return two unit vectors `(n, 3)` each, at right angles to each other and to unit normals `(n, 3)`."""
    least = np.abs(normals).argmin(axis=1)
    along = np.cross(normals, np.eye(3)[least])
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    return along, np.cross(normals, along)


def apart(points: FloatArray, others: FloatArray, distance_mm: float) -> IndexArray:
    """Return the indices of the points `(n, 3)` that have none of the others within a distance."""
    if not len(others):
        return np.arange(len(points))
    distances_mm, _ = cKDTree(others).query(points, distance_upper_bound=distance_mm)
    return np.flatnonzero(~np.isfinite(distances_mm))
