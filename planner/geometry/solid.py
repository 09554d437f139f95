"""Distance between a line segment and a convex solid: a box, a cylinder, or a capsule (a sphere is a short one).

The signed distance to a convex solid (negative inside) is a convex function along a segment. So each tangent is a lower
bound, and the intersections of tangents converge to the minimum. Solids are centered on their own frame, with their
axis along z. Kernels take coordinates as single numbers, in millimeters, and allocate nothing.
"""

from math import sqrt

from planner.geometry.capsule import segment_distance
from planner.kernel import kernel

BOX = 0
"""Size: half of the length in x, y and z."""
CYLINDER = 1
"""Size: the radius, half of the height, unused."""
CAPSULE = 2
"""Size: the radius, half of the length of the segment, unused."""

_TOLERANCE_MM = 1e-7
_MOST_TANGENTS = 64


@kernel
def box_distance(
    x: float, y: float, z: float, half_x: float, half_y: float, half_z: float
) -> tuple[float, float, float, float]:
    """Return the signed distance in mm of a point from a box, and the gradient of the distance."""
    qx, qy, qz = abs(x) - half_x, abs(y) - half_y, abs(z) - half_z
    sign_x = 1.0 if x >= 0.0 else -1.0
    sign_y = 1.0 if y >= 0.0 else -1.0
    sign_z = 1.0 if z >= 0.0 else -1.0
    deepest = max(qx, qy, qz)
    if deepest <= 0.0:
        if deepest == qx:
            return qx, sign_x, 0.0, 0.0
        if deepest == qy:
            return qy, 0.0, sign_y, 0.0
        return qz, 0.0, 0.0, sign_z
    ox, oy, oz = max(qx, 0.0), max(qy, 0.0), max(qz, 0.0)
    distance = sqrt(ox * ox + oy * oy + oz * oz)
    return distance, sign_x * ox / distance, sign_y * oy / distance, sign_z * oz / distance


@kernel
def cylinder_distance(
    x: float, y: float, z: float, radius: float, half_height: float
) -> tuple[float, float, float, float]:
    """Return the signed distance in mm of a point from a cylinder with flat ends, and the gradient of the distance."""
    from_axis = sqrt(x * x + y * y)
    out_x, out_y = (x / from_axis, y / from_axis) if from_axis > 0.0 else (1.0, 0.0)
    sign_z = 1.0 if z >= 0.0 else -1.0
    beside, above = from_axis - radius, abs(z) - half_height
    if beside <= 0.0 and above <= 0.0:
        if beside > above:
            return beside, out_x, out_y, 0.0
        return above, 0.0, 0.0, sign_z
    beside, above = max(beside, 0.0), max(above, 0.0)
    distance = sqrt(beside * beside + above * above)
    return distance, out_x * beside / distance, out_y * beside / distance, sign_z * above / distance


@kernel
def capsule_distance(
    x: float, y: float, z: float, radius: float, half_length: float
) -> tuple[float, float, float, float]:
    """Return the signed distance in mm of a point from a capsule, and the gradient of the distance."""
    z -= min(max(z, -half_length), half_length)
    distance = sqrt(x * x + y * y + z * z)
    if distance == 0.0:
        return -radius, 1.0, 0.0, 0.0
    return distance - radius, x / distance, y / distance, z / distance


@kernel
def point_distance(
    kind: int, size_0: float, size_1: float, size_2: float, x: float, y: float, z: float
) -> tuple[float, float, float, float]:
    """Return the signed distance in mm of a point from a solid, and the gradient of the distance."""
    if kind == BOX:
        return box_distance(x, y, z, size_0, size_1, size_2)
    if kind == CAPSULE:
        return capsule_distance(x, y, z, size_0, size_1)
    return cylinder_distance(x, y, z, size_0, size_1)


@kernel
def solid_distance(
    kind: int, size_0: float, size_1: float, size_2: float,
    ax: float, ay: float, az: float, bx: float, by: float, bz: float, enough_mm: float,
) -> float:  # fmt: skip
    """Return the minimum signed distance in mm of the segment a-b from a solid.

    The result is exact if it is below `enough_mm`; a value at or above that is only known to be sufficient.
    """
    if kind == CAPSULE:
        return segment_distance(ax, ay, az, bx, by, bz, 0.0, 0.0, -size_1, 0.0, 0.0, size_1) - size_0
    ux, uy, uz = bx - ax, by - ay, bz - az
    middle = point_distance(kind, size_0, size_1, size_2, ax + 0.5 * ux, ay + 0.5 * uy, az + 0.5 * uz)[0]
    bound = middle - 0.5 * sqrt(ux * ux + uy * uy + uz * uz)
    if bound >= enough_mm:
        return bound
    low, high = 0.0, 1.0
    low_value, nx, ny, nz = point_distance(kind, size_0, size_1, size_2, ax, ay, az)
    low_slope = nx * ux + ny * uy + nz * uz
    if low_slope >= 0.0:
        return low_value
    high_value, nx, ny, nz = point_distance(kind, size_0, size_1, size_2, bx, by, bz)
    high_slope = nx * ux + ny * uy + nz * uz
    if high_slope <= 0.0:
        return high_value
    least = min(low_value, high_value)
    for _ in range(_MOST_TANGENTS):
        t = (high_value - low_value + low_slope * low - high_slope * high) / (low_slope - high_slope)
        bound = low_value + low_slope * (t - low)
        if bound >= least - _TOLERANCE_MM or bound >= enough_mm:
            return least
        value, nx, ny, nz = point_distance(kind, size_0, size_1, size_2, ax + t * ux, ay + t * uy, az + t * uz)
        slope = nx * ux + ny * uy + nz * uz
        least = min(least, value)
        if slope > 0.0:
            high, high_value, high_slope = t, value, slope
        else:
            low, low_value, low_slope = t, value, slope
    return least
