"""Lower bound of the distance between a box and a solid or a mesh, by branch and bound.

A signed distance changes by no more than the distance moved. So its value in the middle of a box bounds it in the whole
box. Boxes are split until the bounds are close enough. Kernels take coordinates as single numbers, in millimeters.
"""

from math import copysign, sqrt

import numpy as np
from numpy.typing import NDArray

from planner.arrays import FloatArray
from planner.geometry.signed_distance_field import look_up
from planner.geometry.solid import point_distance
from planner.kernel import kernel

FIELD = 3
"""The kind of shape that is a signed distance field; the other kinds are in `planner.geometry.solid`."""

FIELD_TOLERANCE_MM = 2.5
"""Maximum amount by which the result may be below the distance from a field.

The error of the field is additional. Inside, it is half of the depth.
"""
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
    """Return a lower and an upper bound of the minimum distance of the box with the half axes u, v and w."""
    if kind == FIELD:
        reach2 = ux * ux + uy * uy + uz * uz + vx * vx + vy * vy + vz * vz + wx * wx + wy * wy + wz * wz
        distance = look_up(values, levels, x, y, z)
        return distance - sqrt(reach2), distance
    # The distance to a convex solid is a convex function. So its tangent plane is a lower bound, at one of the box's
    # corners.
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
    """Return a lower bound in mm of the minimum signed distance of a box from a shape.

    Outside of a solid, it is at most a thousandth of a mm below the distance. Outside of a field, it is below by at
    most `FIELD_TOLERANCE_MM` plus the error of the field. A result at or above `enough_mm` is only a statement that the
    distance is sufficient.

    Args:
        kind: BOX, CYLINDER or CAPSULE of `planner.geometry.solid`, or FIELD.
        size_0: first size, depends on the kind.
        size_1: second size.
        size_2: third size.
        values: the field, for that kind.
        levels: the grids of the field.
        x: middle of the box in the shape's frame.
        y: its y.
        z: its z.
        ux: first half axis of the box in the shape's frame; the second and the third follow.
        uy: its y.
        uz: its z.
        vx: second half axis.
        vy: its y.
        vz: its z.
        wx: third half axis.
        wy: its y.
        wz: its z.
        enough_mm: the distance that is sufficient.
    """
    lower, least = _bounds(kind, size_0, size_1, size_2, values, levels, x, y, z, ux, uy, uz, vx, vy, vz, wx, wy, wz)
    if lower >= enough_mm:
        return enough_mm
    u, v, w = sqrt(ux * ux + uy * uy + uz * uz), sqrt(vx * vx + vy * vy + vz * vz), sqrt(wx * wx + wy * wy + wz * wz)
    opened = np.empty((_DEEPEST, _COLUMNS))
    _open(opened, 0, x, y, z, 1.0, 1.0, 1.0, lower)
    # More than sufficient by the slack, so that a clear box returns no less than requested.
    least, result, count = min(least, enough_mm + 2.0 * _TOLERANCE_MM), enough_mm, 1
    while count > 0:
        count -= 1
        bound = opened[count, _BOUND]
        if bound >= result or bound >= least - _slack(kind, least):
            result = min(result, bound)
            continue
        x, y, z = opened[count, 0], opened[count, 1], opened[count, 2]
        a, b, c = opened[count, _SHARE], opened[count, _SHARE + 1], opened[count, _SHARE + 2]
        # Halve the longest side; the halves' middles are offset by half of the halved half axis.
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
        # Last in, first out: the nearer one must be last.
        if count > 1 and opened[count - 2, _BOUND] < opened[count - 1, _BOUND]:
            _swap(opened, count - 2, count - 1)
    return result


@kernel
def _slack(kind: int, least: float) -> float:
    """Return how far below the minimum distance found so far a bound is close enough. Deep inside it need not be close.

    For a field, all boxes are split to one size, so that the result does not depend on the order.
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
