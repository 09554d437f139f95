"""A cloud that is to be joined with another one: points, normals, and the space that the laser passed before them."""

from typing import NamedTuple

import numpy as np

from planner.adaptive.voxel_map import VoxelMap
from planner.arrays import FloatArray
from planner.cell.workpiece import Cylinder
from planner.geometry.point_normals import point_normals
from planner.geometry.thinned_cloud import ThinnedCloud

_NORMAL_CELLS = 2.5
_VOXELS = 60.0
"""Of the free space, along the part's diagonal."""
_AROUND = 1.1
"""Size of the space that is looked at, in diagonals of the part."""
_PASSED_MM = 100.0
"""How far before a point the laser's way is looked at: the probe is at least so far away."""


class Cloud(NamedTuple):
    """A thinned cloud.

    Attributes:
        points: `(n, 3)` in mm.
        normals: `(n, 3)` of length 1.
        beams: `(n, 3)` of length 1, the direction of the laser.
        cell_mm: Distance of neighbors.
    """

    points: FloatArray
    normals: FloatArray
    beams: FloatArray
    cell_mm: float

    @classmethod
    def of(cls, thinned: ThinnedCloud) -> "Cloud":
        """Return the points of a thinned cloud whose neighbors determine a normal."""
        points, beams = thinned.points, thinned.beams
        found = point_normals(points, beams, _NORMAL_CELLS * thinned.cell_mm)
        known = found.is_known
        return cls(points[known], found.normals[known], beams[known], thinned.cell_mm)

    def moved(self, T: FloatArray) -> "Cloud":
        """Return the cloud taken by `T` `(4, 4)`."""
        R = T[:3, :3].T
        return Cloud(self.points @ R + T[:3, 3], self.normals @ R, self.beams @ R, self.cell_mm)

    def every(self, step: int) -> "Cloud":
        """Return every `step`th point."""
        return Cloud(self.points[::step], self.normals[::step], self.beams[::step], self.cell_mm)

    def thinned(self, cell_mm: float) -> "Cloud":
        """Return the cloud of larger cells."""
        cloud = ThinnedCloud(cell_mm)
        cloud.take(self.points, self.beams)
        return Cloud.of(cloud)

    def free_space(self) -> VoxelMap:
        """Return where the laser passed on its last way to the points."""
        lower, upper = self.points.min(axis=0), self.points.max(axis=0)
        x, y, z = (float(middle) for middle in 0.5 * (lower + upper))
        size_mm = _AROUND * self.size_mm()
        bounds = Cylinder(size_mm, size_mm, (x, y, z - 0.5 * size_mm))
        voxels = VoxelMap(bounds, max(1.5 * self.cell_mm, self.size_mm() / _VOXELS))
        voxels.take(self.points - _PASSED_MM * self.beams, self.points)
        return voxels

    def size_mm(self) -> float:
        """Return the diagonal of the box around the cloud."""
        return float(np.linalg.norm(np.ptp(self.points, axis=0)))
