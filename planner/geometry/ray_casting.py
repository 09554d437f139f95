"""Cast rays at the triangles of a workpiece: what a ray hits first, and whether two points see each other.

Embree finds the triangle in single precision. The intersection of the ray with the plane of that triangle is then
computed in double precision. So a hit is on the surface to far below a micrometer. Single precision only decides to
which of two neighboring triangles a ray through their common edge belongs.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import trimesh
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from planner.arrays import BoolArray, FloatArray, IndexArray

# Distance from the surface at which a point's own ray starts, so that it does not hit its own triangle.
_LIFT_MM = 0.01


class Hits(NamedTuple):
    """The first hits of rays.

    Attributes:
        triangles: `(n,)`, -1 for a ray without a hit.
        distances_mm: `(n,)` along each ray, in units of its direction's length; NaN without a hit.
    """

    triangles: IndexArray
    distances_mm: FloatArray


class RayCaster:
    """A closed surface for ray casting.

    Attributes:
        normals: `(n_triangles, 3)` outward unit normals; zero for a triangle without area, which no ray hits.
    """

    def __init__(self, mesh: trimesh.Trimesh) -> None:
        """Store a mesh in mm; no ray hits one without triangles."""
        triangles = np.asarray(mesh.triangles, dtype=np.float64)
        across = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        doubled_area = np.linalg.norm(across, axis=1, keepdims=True)
        self.normals: FloatArray = np.divide(across, doubled_area, out=np.zeros_like(across), where=doubled_area > 0.0)
        self._offsets_mm = np.einsum("ij,ij->i", self.normals, triangles[:, 0])
        # Relative to the middle of the part, coordinates are smallest and single precision is finest.
        self._middle_mm = np.zeros(3) if not len(triangles) else np.asarray(mesh.bounds, dtype=np.float64).mean(axis=0)
        self._scene = EmbreeScene(robust=True)
        if not len(triangles):
            return
        vertices = np.asarray(mesh.vertices, dtype=np.float64) - self._middle_mm
        TriangleMesh(self._scene, vertices.astype(np.float32), np.asarray(mesh.faces, dtype=np.int32))

    def first_hits(self, origins: FloatArray, directions: FloatArray) -> Hits:
        """Return the first hit of each ray.

        Args:
            origins: `(n, 3)` in mm.
            directions: `(n, 3)`; for distances in mm they must have length 1.
        """
        found = self._scene.run(self._single(origins), directions.astype(np.float32))
        triangles = np.asarray(found, dtype=np.int64)
        distances = np.full(len(triangles), np.nan)
        hit = np.flatnonzero(triangles >= 0)
        normals = self.normals[triangles[hit]]
        height = self._offsets_mm[triangles[hit]] - np.einsum("ij,ij->i", normals, origins[hit])
        distances[hit] = height / np.einsum("ij,ij->i", normals, directions[hit])
        return Hits(triangles, distances)

    def can_see(self, points: FloatArray, normals: FloatArray, eyes: FloatArray) -> BoolArray:
        """Return whether each eye `(n, 3)` sees its point `(n, 3)` of the surface with outward normal `(n, 3)`."""
        ways = eyes - points
        in_front: BoolArray = np.einsum("ij,ij->i", normals, ways) > _LIFT_MM
        asked = np.flatnonzero(in_front)
        if not len(asked):
            return in_front
        starts = points[asked] + _LIFT_MM * normals[asked]
        ways = eyes[asked] - starts
        # The directions are not of length 1: the eye is at distance 1.
        ends = np.ones(len(asked), dtype=np.float32)
        blocker = self._scene.run(self._single(starts), ways.astype(np.float32), dists=ends, query="OCCLUDED")
        in_front[asked] = np.asarray(blocker) < 0
        return in_front

    def _single(self, points: FloatArray) -> npt.NDArray[np.float32]:
        return np.asarray(points - self._middle_mm, dtype=np.float32)
