"""Distance between capsules. A capsule is the set of points within a radius of a line segment.

The distance of two capsules is the distance of their segments minus both radii, so only the segments are computed.
Kernels take coordinates as single numbers, in millimeters, and allocate nothing.
"""

from math import sqrt

from planner.kernel import kernel

_POINT_MM2 = 1e-18
"""Squared length below which a segment is a point."""
_PARALLEL = 1e-16
"""Squared sine of the angle below which two segments are parallel."""


@kernel
def clamp_unit(value: float) -> float:
    """Return `value` clamped to 0..1."""
    return min(max(value, 0.0), 1.0)


@kernel
def segment_distance(
    ax: float, ay: float, az: float, bx: float, by: float, bz: float,
    cx: float, cy: float, cz: float, dx: float, dy: float, dz: float,
) -> float:  # fmt: skip
    """Return the distance in mm between the segments a-b and c-d; either may be a single point.

    The nearest points of the two lines are clamped to the segments in turn (Ericson, Real-Time Collision Detection,
    section 5.1.9).
    """
    ux, uy, uz = bx - ax, by - ay, bz - az
    vx, vy, vz = dx - cx, dy - cy, dz - cz
    wx, wy, wz = ax - cx, ay - cy, az - cz
    uu = ux * ux + uy * uy + uz * uz
    vv = vx * vx + vy * vy + vz * vz
    uw = ux * wx + uy * wy + uz * wz
    vw = vx * wx + vy * wy + vz * wz
    s = 0.0
    t = 0.0
    if uu <= _POINT_MM2:
        if vv > _POINT_MM2:
            t = clamp_unit(vw / vv)
    elif vv <= _POINT_MM2:
        s = clamp_unit(-uw / uu)
    else:
        uv = ux * vx + uy * vy + uz * vz
        determinant = uu * vv - uv * uv
        if determinant > _PARALLEL * uu * vv:
            s = clamp_unit((uv * vw - uw * vv) / determinant)
        t = (uv * s + vw) / vv
        if t < 0.0:
            t = 0.0
            s = clamp_unit(-uw / uu)
        elif t > 1.0:
            t = 1.0
            s = clamp_unit((uv - uw) / uu)
    gx, gy, gz = wx + s * ux - t * vx, wy + s * uy - t * vy, wz + s * uz - t * vz
    return sqrt(gx * gx + gy * gy + gz * gz)
