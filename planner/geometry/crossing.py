"""Where a surface crosses itself. Bodies that touch do not cross, and files round their corners."""

import numpy as np
import trimesh

from planner.arrays import FloatArray, IndexArray
from planner.geometry.components import connected
from planner.geometry.edges import edges_of
from planner.geometry.winding_number import solid_angles

_TOUCHING = 1e-6
"""How deep, in longest sides of the mesh, bodies may reach into each other and still only touch."""
_ASKED_TRIANGLES = 64


def first_crossing(mesh: trimesh.Trimesh) -> FloatArray | None:
    """Return a point `(3,)` where an edge pierces a triangle that it has no corner in common with, or None."""
    triangles = np.asarray(mesh.triangles)
    near, counts = mesh.triangles_tree.intersection_v(triangles.min(axis=1), triangles.max(axis=1))
    pairs = np.column_stack((np.repeat(np.arange(len(triangles)), counts.astype(np.int64)), near))
    shared = (mesh.faces[pairs[:, 0], :, np.newaxis] == mesh.faces[pairs[:, 1], np.newaxis, :]).any(axis=(1, 2))
    pairs = pairs[~shared]
    depth = _TOUCHING * float(np.max(mesh.extents))
    at_rims = []
    for corner in range(3):
        start = triangles[pairs[:, 0], corner]
        end = triangles[pairs[:, 0], (corner + 1) % 3]
        points, depths = _piercings(start, end, triangles[pairs[:, 1]], depth)
        pierced = np.flatnonzero(depths > depth)
        if len(pierced):
            return np.asarray(points[pierced[0]])
        at_rims.append(pairs[depths > -depth])
    return _first_overlap(mesh, np.concatenate(at_rims), depth)


def _piercings(
    start: FloatArray, end: FloatArray, triangles: FloatArray, depth: float
) -> tuple[FloatArray, FloatArray]:
    """Return where each segment passes through its triangle's plane, and how far inside the triangle that is.

    The second is negative outside the triangle, and -inf where the segment does not reach from `depth` before the
    plane to `depth` behind it.
    """
    corners = [triangles[:, corner] for corner in range(3)]
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    length = np.linalg.norm(normal, axis=1)
    has_area = length > 0.0
    normal /= np.where(has_area, length, 1.0)[:, np.newaxis]
    before, behind = (np.sum((point - corners[0]) * normal, axis=1) for point in (start, end))
    through = has_area & (before * behind < 0.0) & (np.minimum(np.abs(before), np.abs(behind)) > depth)
    t = before / np.where(through, before - behind, 1.0)
    points = start + t[:, np.newaxis] * (end - start)
    inside = np.full(len(start), np.inf)
    for here, there in zip(corners, (*corners[1:], corners[0]), strict=True):
        along = there - here
        across = np.cross(normal, along) / np.maximum(np.linalg.norm(along, axis=1), 1e-300)[:, np.newaxis]
        inside = np.minimum(inside, np.sum((points - here) * across, axis=1))
    return points, np.where(through, inside, -np.inf)


def _first_overlap(mesh: trimesh.Trimesh, pairs: IndexArray, depth: float) -> FloatArray | None:
    """Return a point at which bodies overlap whose edges pierce each other's triangles at their rims only, or None.

    Bodies that lie against each other do so, inside or outside, and bodies that overlap with sides in one plane. Of
    the latter, one body has triangles inside the other one and others outside.
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
        # A triangle that lies on the other body has one side inside and one outside.
        if sides.min(axis=0).max() > 0.9 and sides.max(axis=0).min() < 0.1:
            return np.asarray(middles[np.argmax(sides.min(axis=0))])
    return None
