"""Normals of a cloud of points: of the plane through each point's neighbors, by principal component analysis."""

from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from planner.arrays import BoolArray, FloatArray

_NEIGHBOURS = 32
_BLOCK = 20_000
_FEWEST = 6
"""Points that a plane takes, in both directions of it more than noise."""
_LINE = 0.02
"""Ratio of the middle to the maximum variance below which neighbors lie on a line, which has no normal."""


class PointNormals(NamedTuple):
    """The planes through the neighbors of points.

    Attributes:
        normals: `(n, 3)` of length 1, against the laser's direction.
        roughness_mm: `(n,)` root mean square distance of the neighbors from their plane.
        is_known: `(n,)` whether the neighbors determine a plane; where not, the normal is opposite to the beam.
    """

    normals: FloatArray
    roughness_mm: FloatArray
    is_known: BoolArray


def point_normals(points: FloatArray, beams: FloatArray, radius_mm: float) -> PointNormals:
    """Return the normals of points `(n, 3)` in mm, from their nearest neighbors within a radius.

    Neighbors that were measured from the other side (with a beam against the point's) do not count: they belong to the
    back of a thin wall.

    Args:
        points: The cloud, thinned so that `radius_mm` holds some ten points.
        beams: `(n, 3)` the direction of the laser at each point.
        radius_mm: How far neighbors are looked for.
    """
    normals, roughness_mm = -beams, np.zeros(len(points))
    is_known = np.zeros(len(points), dtype=np.bool_)
    if not len(points):
        return PointNormals(normals, roughness_mm, is_known)
    tree = cKDTree(points)
    for first in range(0, len(points), _BLOCK):
        block = slice(first, first + _BLOCK)
        _, neighbours = tree.query(points[block], k=_NEIGHBOURS, distance_upper_bound=radius_mm)
        found = neighbours < len(points)
        neighbours = np.where(found, neighbours, 0)
        found &= np.einsum("ijk,ik->ij", beams[neighbours], beams[block]) > 0.0
        axes, variances = _principal_axes(points[neighbours], found)
        known = (found.sum(axis=1) >= _FEWEST) & (variances[:, 1] > _LINE * variances[:, 2])
        against = np.einsum("ij,ij->i", axes, beams[block]) > 0.0
        axes[against] *= -1.0
        normals[block] = np.where(known[:, np.newaxis], axes, normals[block])
        roughness_mm[block] = np.sqrt(np.maximum(variances[:, 0], 0.0))
        is_known[block] = known
    return PointNormals(normals, roughness_mm, is_known)


def _principal_axes(points: FloatArray, counted: BoolArray) -> tuple[FloatArray, FloatArray]:
    """Return the axis of least variance `(n, 3)` of n groups of points `(n, k, 3)`, and all variances, ascending."""
    weights = counted / np.maximum(counted.sum(axis=1, keepdims=True), 1)
    off = points - np.einsum("ij,ijk->ik", weights, points)[:, np.newaxis]
    variances, axes = np.linalg.eigh(np.einsum("ij,ijk,ijl->ikl", weights, off, off))
    return axes[:, :, 0].copy(), variances
