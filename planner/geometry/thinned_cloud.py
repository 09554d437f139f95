"""A cloud thinned to the mean of each cell of a regular grid: as many points as the surface has cells.

Averaging takes the noise down with the square root of the points in a cell. Memory depends on the surface that was seen
and not on how often it was seen.
"""

import numpy as np

from planner.arrays import FloatArray, IndexArray

_BITS = 21
"""Bits of a cell's index along each axis: 2 million cells, 1 km at 0.5 mm."""


class ThinnedCloud:
    """Sums of the points and of the laser's directions in each cell, taken in block by block.

    Attributes:
        cell_mm: Side of the cells. Two surfaces that are nearer to one another than this are averaged.
    """

    def __init__(self, cell_mm: float) -> None:
        """Begin without points."""
        self.cell_mm = cell_mm
        self._keys: IndexArray = np.empty(0, dtype=np.int64)
        self._sums: FloatArray = np.empty((0, 7))  # count, x y z, beam x y z

    def take(self, points: FloatArray, beams: FloatArray) -> None:
        """Take in points `(m, 3)` in mm with the directions of the laser there, `(m, 3)` of length 1."""
        rows = np.column_stack((np.ones(len(points)), points, beams))
        keys = np.concatenate((self._keys, _keys(points, self.cell_mm)))
        self._keys, cell = np.unique(keys, return_inverse=True)
        sums = np.zeros((len(self._keys), 7))
        np.add.at(sums, cell, np.concatenate((self._sums, rows)))
        self._sums = sums

    @property
    def counts(self) -> IndexArray:
        """How many points each cell got, `(n,)`."""
        return self._sums[:, 0].astype(np.int64)

    @property
    def points(self) -> FloatArray:
        """The mean point of each cell, `(n, 3)` in mm, in the order of the grid."""
        return np.asarray(self._sums[:, 1:4] / self._sums[:, :1])

    @property
    def beams(self) -> FloatArray:
        """The mean direction of the laser in each cell, `(n, 3)` of length 1."""
        sums = self._sums[:, 4:]
        length = np.linalg.norm(sums, axis=1, keepdims=True)
        # Beams from opposite sides of a thin wall may cancel: such a cell has no direction.
        return np.asarray(np.divide(sums, length, out=np.zeros_like(sums), where=length > 0.0))


def _keys(points: FloatArray, cell_mm: float) -> IndexArray:
    """Return a number `(m,)` for the cell of each point; cells that share a number are the same."""
    cells = np.floor(points / cell_mm).astype(np.int64) + (1 << (_BITS - 1))
    return np.asarray((cells[:, 0] << 2 * _BITS) | (cells[:, 1] << _BITS) | cells[:, 2])
