"""Split the polygons of a surface into triangles."""

from collections.abc import Sequence

import mapbox_earcut
import numpy as np

from planner.arrays import FloatArray, IndexArray
from planner.errors import WorkpieceError


def triangulated(vertices: FloatArray, polygons: Sequence[Sequence[int]]) -> IndexArray:
    """Return the triangles `(n, 3)` of nearly flat polygons with three or more corners each.

    Order and orientation stay the same.

    Raises:
        WorkpieceError: a polygon crosses itself, so no triangles cover it.
    """
    counts = np.fromiter((len(polygon) for polygon in polygons), dtype=np.int64, count=len(polygons))
    firsts = np.concatenate(([0], np.cumsum(counts - 2)))
    triangles = np.empty((firsts[-1], 3), dtype=np.int64)
    for corners, split in ((3, _as_they_are), (4, _quads_split)):
        chosen = np.flatnonzero(counts == corners)
        if len(chosen):
            parts = split(vertices, np.array([polygons[i] for i in chosen.tolist()], dtype=np.int64))
            for part in range(corners - 2):
                triangles[firsts[chosen] + part] = parts[:, part]
    for i in np.flatnonzero(counts > 4).tolist():
        triangles[firsts[i] : firsts[i + 1]] = _polygon_split(vertices, np.array(polygons[i], dtype=np.int64))
    return triangles


def _as_they_are(_vertices: FloatArray, triangles: IndexArray) -> IndexArray:
    return triangles[:, np.newaxis]


def _quads_split(vertices: FloatArray, quads: IndexArray) -> IndexArray:
    """Return `(n, 2, 3)`: each quad divided at its first diagonal, or at the second if only that one is inside."""
    a, b, c, d = (vertices[quads[:, corner]] for corner in range(4))
    with np.errstate(over="ignore", invalid="ignore"):  # implausible coordinates are refused by the size of the mesh
        along_first = np.sum(np.cross(b - a, c - a) * np.cross(c - a, d - a), axis=1) >= 0.0
    first, second = quads[:, [[0, 1, 2], [0, 2, 3]]], quads[:, [[0, 1, 3], [1, 2, 3]]]
    return np.where(along_first[:, np.newaxis, np.newaxis], first, second)


def _polygon_split(vertices: FloatArray, polygon: IndexArray) -> IndexArray:
    """Return `(n - 2, 3)`: one polygon, by ear clipping in its own plane."""
    corners = vertices[polygon] - vertices[polygon[0]]
    normal = np.cross(corners, np.roll(corners, -1, axis=0)).sum(axis=0)  # Newell's, twice the area long
    length = float(np.linalg.norm(normal))
    if not length > 0.0:  # no area, or a corner that is not finite: the caller detects this in the triangles
        return np.array([(polygon[0], *polygon[i : i + 2]) for i in range(1, len(polygon) - 1)])
    # Any axis that is far from the normal defines the plane together with it.
    u = np.cross(np.eye(3)[np.argmin(np.abs(normal))], normal)
    u /= np.linalg.norm(u)
    flat = np.column_stack((corners @ u, corners @ np.cross(normal / length, u)))
    found = mapbox_earcut.triangulate_float64(flat, np.array([len(polygon)], dtype=np.uint32)).reshape(-1, 3)
    if len(found) != len(polygon) - 2:
        x, y, z = vertices[polygon].mean(axis=0)
        raise WorkpieceError(
            f"a face with {len(polygon)} corners, near ({x:g}, {y:g}, {z:g}), cannot be split into triangles;"
            " write the file with triangles"
        )
    p, q, r = (flat[found[:, corner]] for corner in range(3))
    areas = (q[:, 0] - p[:, 0]) * (r[:, 1] - p[:, 1]) - (r[:, 0] - p[:, 0]) * (q[:, 1] - p[:, 1])
    triangles = polygon[found.astype(np.int64)]
    return triangles if areas.sum() > 0.0 else triangles[:, ::-1]
