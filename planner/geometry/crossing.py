"""Find the places at which a surface crosses itself.

Bodies that touch do not cross, and files round their coordinates.
"""

from math import sqrt

import numpy as np
import trimesh

from planner.arrays import FloatArray, IndexArray
from planner.geometry.bounding_volume_hierarchy import bounding_volume_hierarchy
from planner.geometry.components import connected
from planner.geometry.edges import edges_of
from planner.geometry.winding_number import solid_angles
from planner.kernel import kernel
from protocol.program.progress import Progress

_TOUCHING = 1e-6
"""Maximum depth to which bodies may penetrate each other and still only touch, relative to the mesh's longest side."""
_ASKED_TRIANGLES = 64
_BLOCK_TRIANGLES = 16_384
_DEEPEST = 64
"""Maximum depth of the list of open nodes: far more triangles than fit in memory."""


def first_crossing(mesh: trimesh.Trimesh, progress: Progress | None = None) -> FloatArray | None:
    """Return a point `(3,)` at which an edge penetrates a triangle with which it shares no corner, or None.

    Args:
        mesh: the mesh.
        progress: called with the number of finished triangles and of all triangles, between blocks.
    """
    triangles, faces = np.array(mesh.triangles, dtype=np.float64), np.array(mesh.faces, dtype=np.int64)
    hierarchy = bounding_volume_hierarchy(triangles)
    depth = _TOUCHING * float(np.max(mesh.extents))
    at_rims, place, room = [], np.empty(3), 1024
    for first in range(0, len(faces), _BLOCK_TRIANGLES):
        last = min(first + _BLOCK_TRIANGLES, len(faces))
        while True:
            pairs = np.empty((room, 2), dtype=np.int64)
            count = _pierced(triangles, faces, hierarchy.boxes, hierarchy.members, first, last, depth, pairs, place)
            if count <= room:
                break
            room = count
        if count < 0:
            last = len(faces)
        if progress is not None:
            progress(last, len(faces))
        if count < 0:
            return place
        at_rims.append(pairs[:count])
    return _first_overlap(mesh, np.concatenate(at_rims), depth)


@kernel
def _pierced(
    triangles: FloatArray, faces: IndexArray, boxes: FloatArray, members: IndexArray,
    first: int, last: int, depth: float, pairs: IndexArray, place: FloatArray,
) -> int:  # fmt: skip
    """Find the triangles that an edge of the triangles `first` to `last` penetrates.

    If a triangle is penetrated by more than `depth` inside it, the point is written to `place`. If all are penetrated
    only at their edges, the penetrating and the penetrated triangle are written to `pairs`, as far as there is space.

    Returns:
        The number of such pairs, or -1 if `place` is written.
    """
    n_leaves = len(boxes) // 2
    per_leaf = len(members) // n_leaves
    opened = np.empty(_DEEPEST, dtype=np.int64)
    count = 0
    for a in range(first, last):
        opened[0], n_open = 1, 1
        while n_open > 0:
            n_open -= 1
            node = opened[n_open]
            if not _meets(triangles, a, boxes, node):
                continue
            if node < n_leaves:
                opened[n_open], opened[n_open + 1] = 2 * node, 2 * node + 1
                n_open += 2
                continue
            for at in range((node - n_leaves) * per_leaf, (node - n_leaves + 1) * per_leaf):
                inside = _depth_of_piercing(triangles, faces, a, members[at], depth, place)
                if inside > depth:
                    return -1
                if inside > -depth:
                    if count < len(pairs):
                        pairs[count, 0], pairs[count, 1] = a, members[at]
                    count += 1
    return count


@kernel
def _meets(triangles: FloatArray, a: int, boxes: FloatArray, node: int) -> bool:
    """Return whether the box of a triangle intersects that of a node."""
    for axis in range(3):
        p, q, r = triangles[a, 0, axis], triangles[a, 1, axis], triangles[a, 2, axis]
        if max(p, q, r) < boxes[node, axis] or min(p, q, r) > boxes[node, 3 + axis]:
            return False
    return True


@kernel
def _has_common_corner(faces: IndexArray, a: int, b: int) -> bool:
    for i in range(3):
        for j in range(3):
            if faces[a, i] == faces[b, j]:
                return True
    return False


@kernel
def _depth_of_piercing(
    triangles: FloatArray, faces: IndexArray, a: int, b: int, depth: float, place: FloatArray
) -> float:
    """Return how far inside triangle b the edges of triangle a penetrate it; -inf if they share a corner.

    The result is the maximum of the three, or the first value above `depth`; then `place` is that point.
    """
    deepest = -np.inf
    if _has_common_corner(faces, a, b):
        return deepest
    for corner in range(3):
        deepest = max(deepest, _piercing(triangles, a, corner, b, depth, place))
        if deepest > depth:
            break
    return deepest


@kernel
def _piercing(triangles: FloatArray, a: int, corner: int, b: int, depth: float, place: FloatArray) -> float:
    """Return how far inside triangle b an edge of triangle a crosses its plane, and write the point to `place`.

    The result is negative outside the triangle. It is -inf if the edge does not reach from `depth` before the plane to
    `depth` behind it.
    """
    ax, ay, az = triangles[b, 0, 0], triangles[b, 0, 1], triangles[b, 0, 2]
    ux, uy, uz = triangles[b, 1, 0] - ax, triangles[b, 1, 1] - ay, triangles[b, 1, 2] - az
    vx, vy, vz = triangles[b, 2, 0] - ax, triangles[b, 2, 1] - ay, triangles[b, 2, 2] - az
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    length = sqrt(nx * nx + ny * ny + nz * nz)
    if length == 0.0:
        return -np.inf
    nx, ny, nz = nx / length, ny / length, nz / length
    to = (corner + 1) % 3
    px, py, pz = triangles[a, corner, 0], triangles[a, corner, 1], triangles[a, corner, 2]
    qx, qy, qz = triangles[a, to, 0], triangles[a, to, 1], triangles[a, to, 2]
    before = (px - ax) * nx + (py - ay) * ny + (pz - az) * nz
    behind = (qx - ax) * nx + (qy - ay) * ny + (qz - az) * nz
    if before * behind >= 0.0 or min(abs(before), abs(behind)) <= depth:
        return -np.inf
    t = before / (before - behind)
    x, y, z = px + t * (qx - px), py + t * (qy - py), pz + t * (qz - pz)
    inside = np.inf
    for here in range(3):
        there = (here + 1) % 3
        hx, hy, hz = triangles[b, here, 0], triangles[b, here, 1], triangles[b, here, 2]
        ex, ey, ez = triangles[b, there, 0] - hx, triangles[b, there, 1] - hy, triangles[b, there, 2] - hz
        cx, cy, cz = ny * ez - nz * ey, nz * ex - nx * ez, nx * ey - ny * ex
        along = max(sqrt(ex * ex + ey * ey + ez * ez), 1e-300)
        inside = min(inside, ((x - hx) * cx + (y - hy) * cy + (z - hz) * cz) / along)
    place[0], place[1], place[2] = x, y, z
    return inside


def _first_overlap(mesh: trimesh.Trimesh, pairs: IndexArray, depth: float) -> FloatArray | None:
    """Return a point at which bodies overlap whose edges penetrate each other's triangles only at the edges, or None.

    Bodies that are in contact do so, inside or outside, and so do bodies that overlap with coplanar sides. In the
    latter case, one body has some triangles inside the other one and some outside.
    """
    faces, triangles = np.asarray(mesh.faces), np.asarray(mesh.triangles)
    patches = connected(edges_of(faces).shared_by_two()[0], len(faces))
    met = patches[np.concatenate((pairs, pairs[:, ::-1]))]
    across = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    doubled_area = np.linalg.norm(across, axis=1)
    for patch, other in np.unique(met[met[:, 0] != met[:, 1]], axis=0):
        asked = np.flatnonzero((patches == patch) & (doubled_area > 0.0))
        asked = asked[:: len(asked) // _ASKED_TRIANGLES + 1]
        middles = triangles[asked].mean(axis=1)
        lift = 10.0 * depth * across[asked] / doubled_area[asked, np.newaxis]
        turns = np.abs(solid_angles(triangles[patches == other], np.concatenate((middles + lift, middles - lift))))
        sides = turns.reshape(2, -1) / (4.0 * np.pi)
        # A triangle in contact with the other body has one side inside and one outside.
        if sides.min(axis=0).max() > 0.9 and sides.max(axis=0).min() < 0.1:
            return np.asarray(middles[np.argmax(sides.min(axis=0))])
    return None
