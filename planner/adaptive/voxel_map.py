"""What is known of the space around a part that nobody has a mesh of: a voxel is unknown, free, or holds surface.

Space is free where a laser ray passed on its way to a point that was measured; a ray without a measurement proves
nothing. The probe does not report which of its cameras saw a spot, so their rays prove nothing either. Everything
else inside the bounding cylinder counts as solid. Outside of it is free: that is what its user vouches for.
"""

from math import sqrt

import numpy as np
from scipy.ndimage import distance_transform_edt
from scipy.spatial import cKDTree

from planner.arrays import BoolArray, CodeArray, FloatArray, IndexArray
from planner.cell.workpiece import Cylinder
from planner.geometry.signed_distance_field import SignedDistanceField
from planner.kernel import kernel

UNKNOWN, FREE, SURFACE = 0, 1, 2

_MARGIN = 2
"""Voxels beyond the cylinder on each side."""
_COARSER = 3
_REACH_MM = 300.0
"""How far the coarse grids of the distance field reach: beyond what the clearance looks at."""
_BESIDE = 5
_FACES = ((0, 1), (0, -1), (1, 1), (1, -1), (2, 1), (2, -1))
_DIAGONAL = sqrt(3.0)


class VoxelMap:
    """A regular grid of voxels over a bounding cylinder, in frame W.

    Attributes:
        states: `(nx, ny, nz)`, each UNKNOWN, FREE or SURFACE.
        is_within: `(nx, ny, nz)`, which of them are in the cylinder.
        lower_mm: `(3,)` the corner of the first voxel.
        voxel_mm: Side of a voxel.
    """

    def __init__(self, bounds: Cylinder, voxel_mm: float) -> None:
        """Begin with all of the cylinder unknown."""
        radius_mm = 0.5 * bounds.diameter_mm
        x, y, z = bounds.middle_mm
        sides_mm = np.array((bounds.diameter_mm, bounds.diameter_mm, bounds.height_mm))
        shape = np.ceil(sides_mm / voxel_mm).astype(int) + 2 * _MARGIN
        middle = np.array((x, y, z + 0.5 * bounds.height_mm))
        self.voxel_mm = voxel_mm
        self.lower_mm: FloatArray = middle - 0.5 * voxel_mm * shape
        across, along, up = (
            np.abs(self.lower_mm[axis] + voxel_mm * (np.arange(shape[axis]) + 0.5) - middle[axis]) - 0.5 * voxel_mm
            for axis in range(3)
        )
        # A voxel that the cylinder only touches counts as part of it.
        radial2 = np.maximum(across, 0.0)[:, np.newaxis] ** 2 + np.maximum(along, 0.0) ** 2
        inside = (radial2 < radius_mm**2)[:, :, np.newaxis] & (up < 0.5 * bounds.height_mm)
        self.is_within: BoolArray = inside
        self.states: CodeArray = np.where(inside, UNKNOWN, FREE).astype(np.uint8)

    def take(self, origins: FloatArray, points: FloatArray) -> None:
        """Take in points `(m, 3)` that were measured, and where the laser's ray to each began, `(m, 3)`, in mm.

        A ray frees what it passes, but for the last voxel's diagonal before its point.
        """
        gap_mm = _DIAGONAL * self.voxel_mm
        _carve(self.states, self.lower_mm, self.voxel_mm, np.ascontiguousarray(origins), points, gap_mm)
        cells, inside = self.cells(points)
        self.states[tuple(cells[inside].T)] = SURFACE

    def states_at(self, points: FloatArray) -> CodeArray:
        """Return the state `(m,)` of the voxels that points `(m, 3)` lie in; FREE beyond the grid."""
        cells, inside = self.cells(points)
        states = np.full(len(points), FREE, dtype=np.uint8)
        states[inside] = self.states[tuple(cells[inside].T)]
        return states

    def frontier(self) -> tuple[FloatArray, FloatArray]:
        """Return the middles `(n, 3)` of unknown voxels beside free ones, and unit vectors `(n, 3)` to the free."""
        free = self.states == FREE
        outward = np.zeros((*self.states.shape, 3))
        for axis, step in _FACES:
            outward[..., axis] += step * np.roll(free, -step, axis=axis)
        length = np.linalg.norm(outward, axis=3)
        at = np.nonzero((self.states == UNKNOWN) & (length > 0.0))
        return self._middles(np.stack(at, axis=1)), outward[at] / length[at][:, np.newaxis]

    def field(self) -> SignedDistanceField:
        """Return the distance from what may be solid: a lower bound.

        A voxel is free as a whole when a ray passed any part of it. The rays of a profile are a tenth of a millimeter
        apart, so nothing fits between them; but beside the outermost one, a body may reach from a solid voxel into a
        free one. Its surface is less than a voxel's diagonal from the solid voxel, and the distance is less by that.
        """
        solid = self.states != FREE
        # From the middle of a voxel to its corners, and by how much a body may reach into the next one.
        off_mm = 1.5 * _DIAGONAL * self.voxel_mm
        outside_mm = self.voxel_mm * distance_transform_edt(~solid) - off_mm
        inside_mm = self.voxel_mm * distance_transform_edt(solid) + off_mm
        values = [np.where(solid, -inside_mm, outside_mm).astype(np.float32).ravel()]
        origin, shape, spacing_mm = self.lower_mm + 0.5 * self.voxel_mm, np.array(solid.shape), self.voxel_mm
        levels = [(*origin, spacing_mm, *shape)]
        middle, reach_mm = origin + 0.5 * spacing_mm * (shape - 1), 0.5 * spacing_mm * shape.max() + _REACH_MM
        tree = cKDTree(self._middles(np.argwhere(solid & _beside(~solid)))) if solid.any() else None
        while (0.5 * spacing_mm * (shape - 1) < reach_mm).any():
            shape, spacing_mm = -(-shape // _COARSER) + 2 * _BESIDE, _COARSER * spacing_mm
            origin = middle - 0.5 * spacing_mm * (shape - 1)
            levels.append((*origin, spacing_mm, *shape))
            values.append(self._coarse(tree, origin, spacing_mm, shape, off_mm))
        return SignedDistanceField(np.concatenate(values), np.array(levels, dtype=np.float64))

    def _coarse(
        self, tree: "cKDTree | None", origin: FloatArray, spacing_mm: float, shape: IndexArray, off_mm: float
    ) -> np.ndarray[tuple[int], np.dtype[np.float32]]:
        """Return the distances at the points of a coarse grid, z running fastest."""
        points = origin + spacing_mm * np.indices(tuple(shape.tolist())).reshape(3, -1).T
        if tree is None:
            return np.full(len(points), _REACH_MM, dtype=np.float32)
        distances_mm = tree.query(points)[0]
        inside = self.states_at(points) != FREE
        return np.where(inside, -distances_mm - off_mm, distances_mm - off_mm).astype(np.float32)

    def cells(self, points: FloatArray) -> tuple[IndexArray, BoolArray]:
        """Return the voxels `(m, 3)` that points `(m, 3)` lie in, and which of them are in the grid."""
        cells = np.floor((points - self.lower_mm) / self.voxel_mm).astype(np.int64)
        return cells, np.asarray(((cells >= 0) & (cells < self.states.shape)).all(axis=1))

    def _middles(self, cells: IndexArray) -> FloatArray:
        return np.asarray(self.lower_mm + self.voxel_mm * (cells + 0.5))


def _beside(mask: BoolArray) -> BoolArray:
    """Return which cells have a neighbor in the mask, across a face; the grid's ends are joined."""
    found = np.zeros_like(mask)
    for axis, step in _FACES:
        found |= np.roll(mask, -step, axis=axis)
    return found


@kernel
def _carve(  # noqa: C901 - one walk along one ray: calls in between would pass its arrays on
    states: CodeArray, lower: FloatArray, voxel_mm: float, origins: FloatArray, points: FloatArray, gap_mm: float
) -> None:
    """Free the unknown voxels that rays pass until `gap_mm` before their points (Amanatides and Woo, 1987)."""
    cell, step, shape = np.empty(3, dtype=np.int64), np.empty(3, dtype=np.int64), states.shape
    crossing, between = np.empty(3), np.empty(3)
    for i in range(len(points)):
        length2 = 0.0
        for axis in range(3):
            way = points[i, axis] - origins[i, axis]
            length2 += way * way
        begin, end = 0.0, 1.0 - gap_mm / sqrt(length2) if length2 > 0.0 else 0.0
        for axis in range(3):
            way = (points[i, axis] - origins[i, axis]) / voxel_mm
            start = (origins[i, axis] - lower[axis]) / voxel_mm
            if way == 0.0:
                if not 0.0 <= start < shape[axis]:
                    end = -1.0
                continue
            first, second = -start / way, (shape[axis] - start) / way
            begin, end = max(begin, min(first, second)), min(end, max(first, second))
        if begin >= end:
            continue
        for axis in range(3):
            way = (points[i, axis] - origins[i, axis]) / voxel_mm
            at = (origins[i, axis] - lower[axis]) / voxel_mm + begin * way
            cell[axis] = min(max(int(at), 0), shape[axis] - 1)
            step[axis] = 1 if way > 0.0 else -1
            between[axis] = abs(1.0 / way) if way != 0.0 else np.inf
            wall = cell[axis] + (1.0 if way > 0.0 else 0.0)
            crossing[axis] = begin + (wall - at) / way if way != 0.0 else np.inf
        while True:
            if states[cell[0], cell[1], cell[2]] == UNKNOWN:
                states[cell[0], cell[1], cell[2]] = FREE
            axis = 0 if crossing[0] <= crossing[1] and crossing[0] <= crossing[2] else 1
            if axis == 1 and crossing[2] < crossing[1]:
                axis = 2
            if crossing[axis] >= end:
                break
            cell[axis] += step[axis]
            if not 0 <= cell[axis] < shape[axis]:
                break
            crossing[axis] += between[axis]
