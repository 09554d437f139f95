"""The winding number of a closed surface around each point of a grid: whether the point is inside."""

from math import ceil, floor, sqrt

import numpy as np
from numpy.typing import NDArray

from planner.arrays import FloatArray
from planner.kernel import kernel

BESIDE = 1e-3 / sqrt(2.0), 1e-3 / sqrt(3.0)
"""Offset in grid spacings along x and y of the line through the surface from the line of the grid.

Parts with round dimensions have walls and edges exactly on the lines of the grid, where rounding would decide.
"""


def winding_numbers(
    triangles: FloatArray, origin: FloatArray, spacing_mm: float, shape: tuple[int, ...]
) -> NDArray[np.int32]:
    """Return the winding number of the surface around each point of the grid: above 0 inside, 0 outside.

    It is the number of faces above the point that face up, minus the number that face down. The vertical line is offset
    from the point by `BESIDE`, so the number can only be wrong where the distance to the surface is smaller.

    Args:
        triangles: `(n, 3, 3)`, the corners of a closed surface in mm, counterclockwise seen from outside.
        origin: `(3,)`, the grid's first point.
        spacing_mm: spacing of the grid.
        shape: number of points of the grid along x, y and z.
    """
    crossings = np.zeros(shape, dtype=np.int32)
    corners = (triangles - origin) / spacing_mm - (*BESIDE, 0.0)
    _count_crossings(np.ascontiguousarray(corners), crossings)
    above: NDArray[np.int32] = np.cumsum(crossings[:, :, ::-1], axis=2, dtype=np.int32)[:, :, ::-1]
    return above


@kernel
def _count_crossings(triangles: FloatArray, crossings: NDArray[np.int32]) -> None:
    """Add each crossing of a vertical grid line with a triangle to the highest grid point below it.

    Corners `(n, 3, 3)` are in grid spacings from the grid's first point. The side of a line relative to an edge has the
    exactly opposite sign for the neighbor, which has the edge in the opposite direction. So a line through a closed
    surface passes between no two triangles.
    """
    nx, ny, nz = crossings.shape
    for t in range(len(triangles)):
        c = triangles[t]
        least_x, most_x = min(c[0, 0], c[1, 0], c[2, 0]), max(c[0, 0], c[1, 0], c[2, 0])
        least_y, most_y = min(c[0, 1], c[1, 1], c[2, 1]), max(c[0, 1], c[1, 1], c[2, 1])
        for i in range(max(ceil(least_x), 0), min(floor(most_x), nx - 1) + 1):
            for j in range(max(ceil(least_y), 0), min(floor(most_y), ny - 1) + 1):
                side_0 = (c[1, 0] - i) * (c[2, 1] - j) - (c[2, 0] - i) * (c[1, 1] - j)
                side_1 = (c[2, 0] - i) * (c[0, 1] - j) - (c[0, 0] - i) * (c[2, 1] - j)
                side_2 = (c[0, 0] - i) * (c[1, 1] - j) - (c[1, 0] - i) * (c[0, 1] - j)
                up = side_0 > 0.0
                if up != (side_1 > 0.0) or up != (side_2 > 0.0):
                    continue
                area = side_0 + side_1 + side_2
                if area == 0.0:
                    continue
                height = (side_0 * c[0, 2] + side_1 * c[1, 2] + side_2 * c[2, 2]) / area
                below = min(ceil(height), nz) - 1
                if below >= 0:
                    crossings[i, j, below] += 1 if up else -1


def solid_angles(triangles: FloatArray, points: FloatArray) -> FloatArray:
    """Return the solid angle `(m,)` in steradian of a surface, seen from points `(m, 3)`.

    Inside of a closed surface it is 4 pi, outside 0 (van Oosterom and Strackee, 1983).

    Args:
        triangles: `(n, 3, 3)`, counterclockwise seen from outside.
        points: `(m, 3)`.
    """
    a, b, c = (triangles[:, corner] - points[:, np.newaxis] for corner in range(3))
    la, lb, lc = (np.linalg.norm(side, axis=2) for side in (a, b, c))
    volume = np.einsum("mni,mni->mn", a, np.cross(b, c))
    ab, bc, ca = (np.einsum("mni,mni->mn", p, q) for p, q in ((a, b), (b, c), (c, a)))
    return np.asarray(2.0 * np.arctan2(volume, la * lb * lc + ab * lc + bc * la + ca * lb).sum(axis=1))
