"""Distance between a box and a solid or a mesh, from below, by branch and bound.

A signed distance changes by no more than the way that is gone, so what it is in the middle of a box bounds it in all of
the box. Boxes are split until the bounds are close enough. Kernels take coordinates one by one, in millimeters.
"""

from math import copysign, sqrt

import numpy as np
from numpy.typing import NDArray

from planner.arrays import FloatArray
from planner.geometry.signed_distance_field import look_up
from planner.geometry.solid import point_distance
from planner.kernel import kernel

FIELD = 3
"""The kind of shape that is a signed distance field; the other kinds are those of `planner.geometry.solid`."""

FIELD_TOLERANCE_MM = 2.5
"""How far below the distance from a field the result may be, besides what the field is off; inside, half the depth."""
_TOLERANCE_MM = 1e-3
"""The same for a solid."""
_DEEPEST = 64
# The columns of an open box: its middle, its share of the three half axes, the bound of its distances.
_SHARE, _BOUND, _COLUMNS = 3, 6, 7


@kernel
def _bounds(
    kind: int, size_0: float, size_1: float, size_2: float,
    values: NDArray[np.float32], levels: FloatArray,
    x: float, y: float, z: float,
    ux: float, uy: float, uz: float, vx: float, vy: float, vz: float, wx: float, wy: float, wz: float,
) -> tuple[float, float]:  # fmt: skip
    """Return a lower and an upper bound of the least distance of the box with the half axes u, v and w."""
    if kind == FIELD:
        reach2 = ux * ux + uy * uy + uz * uz + vx * vx + vy * vy + vz * vz + wx * wx + wy * wy + wz * wz
        distance = look_up(values, levels, x, y, z)
        return distance - sqrt(reach2), distance
    # The distance to a convex solid is a convex function, so its tangent plane bounds it, at one of the box's corners.
    distance, nx, ny, nz = point_distance(kind, size_0, size_1, size_2, x, y, z)
    along_u, along_v, along_w = nx * ux + ny * uy + nz * uz, nx * vx + ny * vy + nz * vz, nx * wx + ny * wy + nz * wz
    lower = distance - abs(along_u) - abs(along_v) - abs(along_w)
    a, b, c = copysign(1.0, along_u), copysign(1.0, along_v), copysign(1.0, along_w)
    x, y, z = x - a * ux - b * vx - c * wx, y - a * uy - b * vy - c * wy, z - a * uz - b * vz - c * wz
    return lower, min(distance, point_distance(kind, size_0, size_1, size_2, x, y, z)[0])


@kernel
def box_distance_bound(
    kind: int, size_0: float, size_1: float, size_2: float,
    values: NDArray[np.float32], levels: FloatArray,
    x: float, y: float, z: float,
    ux: float, uy: float, uz: float, vx: float, vy: float, vz: float, wx: float, wy: float, wz: float,
    enough_mm: float,
) -> float:  # fmt: skip
    """Return a lower bound in mm of the least signed distance of a box from a shape.

    Outside, it is at most a thousandth of a mm below that of a solid, and at most `FIELD_TOLERANCE_MM`, plus what the
    field itself is off, below that of a field. A result at or above `enough_mm` is only known to be so.

    Args:
        kind: BOX, CYLINDER or CAPSULE of `planner.geometry.solid`, or FIELD.
        size_0: As the kind has it; so are the next two.
        size_1: See there.
        size_2: See there.
        values: The field, for that kind.
        levels: The field's grids.
        x: The middle of the box in the shape's frame.
        y: See there.
        z: See there.
        ux: The first half axis of the box in the shape's frame; then follow the second and the third.
        uy: See there.
        uz: See there.
        vx: See there.
        vy: See there.
        vz: See there.
        wx: See there.
        wy: See there.
        wz: See there.
        enough_mm: The distance from which on it is of no interest.
    """
    lower, least = _bounds(kind, size_0, size_1, size_2, values, levels, x, y, z, ux, uy, uz, vx, vy, vz, wx, wy, wz)
    if lower >= enough_mm:
        return enough_mm
    u, v, w = sqrt(ux * ux + uy * uy + uz * uz), sqrt(vx * vx + vy * vy + vz * vz), sqrt(wx * wx + wy * wy + wz * wz)
    opened = np.empty((_DEEPEST, _COLUMNS))
    _open(opened, 0, x, y, z, 1.0, 1.0, 1.0, lower)
    # Above what is enough by more than the slack, so that a box that is free gets no less than was asked.
    least, result, count = min(least, enough_mm + 2.0 * _TOLERANCE_MM), enough_mm, 1
    while count > 0:
        count -= 1
        bound = opened[count, _BOUND]
        if bound >= result or bound >= least - _slack(kind, least):
            result = min(result, bound)
            continue
        x, y, z = opened[count, 0], opened[count, 1], opened[count, 2]
        a, b, c = opened[count, _SHARE], opened[count, _SHARE + 1], opened[count, _SHARE + 2]
        # Halve the longest side; the halves' middles are off by a half of the halved half axis.
        if a * u >= b * v and a * u >= c * w:
            a *= 0.5
            dx, dy, dz = a * ux, a * uy, a * uz
        elif b * v >= c * w:
            b *= 0.5
            dx, dy, dz = b * vx, b * vy, b * vz
        else:
            c *= 0.5
            dx, dy, dz = c * wx, c * wy, c * wz
        for side in (-1.0, 1.0):
            px, py, pz = x + side * dx, y + side * dy, z + side * dz
            lower, upper = _bounds(
                kind, size_0, size_1, size_2, values, levels, px, py, pz,
                a * ux, a * uy, a * uz, b * vx, b * vy, b * vz, c * wx, c * wy, c * wz,
            )  # fmt: skip
            least, lower = min(least, upper), max(lower, bound)  # no part of a box is nearer than the whole
            if kind == FIELD and upper - lower <= max(FIELD_TOLERANCE_MM, -0.5 * upper):
                result = min(result, lower)
            else:
                _open(opened, count, px, py, pz, a, b, c, lower)
                count += 1
        # The last one in is the first one out, and that should be the nearer one.
        if count > 1 and opened[count - 2, _BOUND] < opened[count - 1, _BOUND]:
            _swap(opened, count - 2, count - 1)
    return result


@kernel
def _slack(kind: int, least: float) -> float:
    """Return how far below the least distance met so far a bound is close enough: deep inside it need not be close.

    Of a field, all boxes are split to one size, so that the result does not depend on what was met before.
    """
    return 0.0 if kind == FIELD else max(_TOLERANCE_MM, -0.5 * least)


@kernel
def _swap(opened: FloatArray, i: int, j: int) -> None:
    for column in range(_COLUMNS):
        opened[i, column], opened[j, column] = opened[j, column], opened[i, column]


@kernel
def _open(
    opened: FloatArray, at: int, x: float, y: float, z: float, a: float, b: float, c: float, bound: float
) -> None:
    opened[at, 0], opened[at, 1], opened[at, 2] = x, y, z
    opened[at, _SHARE], opened[at, _SHARE + 1], opened[at, _SHARE + 2] = a, b, c
    opened[at, _BOUND] = bound
