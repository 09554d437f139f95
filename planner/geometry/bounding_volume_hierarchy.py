"""A bounding volume hierarchy of triangles: a balanced tree of boxes that finds the nearest triangle of a mesh.

The tree is stored as a heap: node 1 is the root, node i has the children 2i and 2i + 1, and all leaves have the same
number of triangles. Kernels take coordinates as single numbers, in millimeters.
"""

from typing import NamedTuple

import numpy as np

from planner.arrays import FloatArray, IndexArray
from planner.geometry.capsule import clamp_unit
from planner.kernel import kernel

_LEAF_TRIANGLES = 4
_DEEPEST = 64
"""Maximum depth of the list of open nodes: far more triangles than fit in memory."""
_FLAT = 1e-20
"""Squared sine of a triangle's angle below which it has no plane, only edges."""


class BoundingVolumeHierarchy(NamedTuple):
    """A tree of boxes over triangles.

    Attributes:
        triangles: `(n_leaves * m, 3, 3)`, the corners, leaf by leaf; some triangles are repeated to fill the leaves.
        boxes: `(2 n_leaves, 6)`, the minimum and maximum x y z of each node; the first row is unused.
        members: `(n_leaves * m,)`, index of each triangle in the input.
    """

    triangles: FloatArray
    boxes: FloatArray
    members: IndexArray


def bounding_volume_hierarchy(triangles: FloatArray) -> BoundingVolumeHierarchy:
    """Return the hierarchy of triangles `(n, 3, 3)`. Each node is split at the median of its longest side."""
    n_leaves = 1
    while n_leaves * _LEAF_TRIANGLES < len(triangles):
        n_leaves *= 2
    middles = triangles.mean(axis=1)
    per_leaf = -(-len(triangles) // n_leaves)
    order = np.resize(np.arange(len(triangles)), (1, n_leaves * per_leaf))
    while len(order) < n_leaves:
        along = np.argmax(np.ptp(middles[order], axis=1), axis=1)
        ranks = np.argsort(middles[order, along[:, np.newaxis]], axis=1, kind="stable")
        order = np.take_along_axis(order, ranks, axis=1).reshape(2 * len(order), -1)
    leaves = triangles[order]
    boxes = np.empty((2 * n_leaves, 6))
    boxes[n_leaves:] = np.hstack((leaves.min(axis=(1, 2)), leaves.max(axis=(1, 2))))
    first = n_leaves // 2
    while first > 0:
        children = boxes[2 * first : 4 * first].reshape(first, 2, 6)
        boxes[first : 2 * first] = np.hstack((children[:, :, :3].min(axis=1), children[:, :, 3:].max(axis=1)))
        first //= 2
    return BoundingVolumeHierarchy(leaves.reshape(-1, 3, 3), boxes, order.reshape(-1))


@kernel
def nearest_triangle(
    triangles: FloatArray, boxes: FloatArray, x: float, y: float, z: float, guess: int
) -> tuple[float, int]:
    """Return the squared distance in mm2 of a point from the nearest triangle, and the index of that triangle.

    Args:
        triangles: see `BoundingVolumeHierarchy`.
        boxes: see `BoundingVolumeHierarchy`.
        x: x of the point.
        y: y of the point.
        z: z of the point.
        guess: a triangle to start with; the nearer it is, the smaller is the searched part of the tree.
    """
    n_leaves = len(boxes) // 2
    per_leaf = len(triangles) // n_leaves
    least, nearest = triangle_distance2(triangles, guess, x, y, z), guess
    opened = np.empty(_DEEPEST, dtype=np.int64)
    opened[0], count = 1, 1
    while count > 0:
        count -= 1
        node = opened[count]
        if box_distance2(boxes, node, x, y, z) >= least:
            continue
        if node >= n_leaves:
            first = (node - n_leaves) * per_leaf
            for triangle in range(first, first + per_leaf):
                distance2 = triangle_distance2(triangles, triangle, x, y, z)
                if distance2 < least:
                    least, nearest = distance2, triangle
        else:
            # Last in, first out: the nearer one must be last.
            swap = box_distance2(boxes, 2 * node, x, y, z) < box_distance2(boxes, 2 * node + 1, x, y, z)
            opened[count], opened[count + 1] = 2 * node + swap, 2 * node + (not swap)
            count += 2
    return least, nearest


@kernel
def box_distance2(boxes: FloatArray, node: int, x: float, y: float, z: float) -> float:
    """Return the squared distance in mm2 of a point from a node's box, 0 inside."""
    dx = max(boxes[node, 0] - x, x - boxes[node, 3], 0.0)
    dy = max(boxes[node, 1] - y, y - boxes[node, 4], 0.0)
    dz = max(boxes[node, 2] - z, z - boxes[node, 5], 0.0)
    return float(dx * dx + dy * dy + dz * dz)


@kernel
def triangle_distance2(triangles: FloatArray, i: int, x: float, y: float, z: float) -> float:
    """Return the squared distance in mm2 of a point from a triangle: from its plane, or else from its edges."""
    ax, ay, az = triangles[i, 0, 0], triangles[i, 0, 1], triangles[i, 0, 2]
    bx, by, bz = triangles[i, 1, 0], triangles[i, 1, 1], triangles[i, 1, 2]
    cx, cy, cz = triangles[i, 2, 0], triangles[i, 2, 1], triangles[i, 2, 2]
    ux, uy, uz = bx - ax, by - ay, bz - az
    vx, vy, vz = cx - ax, cy - ay, cz - az
    px, py, pz = x - ax, y - ay, z - az
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    nn = nx * nx + ny * ny + nz * nz
    uu, vv = ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz
    if nn > _FLAT * uu * vv:
        # Twice the signed areas, times the normal's length, of the foot point with each edge.
        beside_v = (uy * pz - uz * py) * nx + (uz * px - ux * pz) * ny + (ux * py - uy * px) * nz
        beside_u = (py * vz - pz * vy) * nx + (pz * vx - px * vz) * ny + (px * vy - py * vx) * nz
        if beside_u >= 0.0 and beside_v >= 0.0 and beside_u + beside_v <= nn:
            height = px * nx + py * ny + pz * nz
            return float(height * height / nn)
    return min(
        _edge_distance2(ux, uy, uz, px, py, pz),
        _edge_distance2(vx, vy, vz, px, py, pz),
        _edge_distance2(cx - bx, cy - by, cz - bz, x - bx, y - by, z - bz),
    )


@kernel
def _edge_distance2(ux: float, uy: float, uz: float, px: float, py: float, pz: float) -> float:
    uu = ux * ux + uy * uy + uz * uz
    t = clamp_unit((ux * px + uy * py + uz * pz) / uu) if uu > 0.0 else 0.0
    dx, dy, dz = px - t * ux, py - t * uy, pz - t * uz
    return dx * dx + dy * dy + dz * dz
