"""Clearances between the arm, the probe, its beam and the cell (section 3 of the paper).

The clearance of a pose is the minimum signed distance over all pairs that can collide. So the value function can rate
proximity, and the pair with the minimum is the reason for a low value. The beam is a light ray and not a body: it may
be close to a body, and counts only when it is blocked.
"""

from math import sqrt

import numpy as np
import numpy.typing as npt

from planner.arrays import FloatArray, IndexArray
from planner.cell.collision_model import (
    END,
    FRAME,
    KIND,
    LOWER,
    MIDDLE,
    RADIUS,
    SIZE,
    START,
    THIRD,
    UPPER,
)
from planner.geometry.box_distance import FIELD, box_distance_bound
from planner.geometry.capsule import segment_distance
from planner.geometry.signed_distance_field import field_distance
from planner.geometry.solid import BOX, solid_distance
from planner.kernel import kernel

ARM_FRAMES = 4
"""The frames from the base on with which bodies move.

No body moves with a frame of the wrist; the flange's frame is the last.
"""

# The columns of a placed body: its ends and its middle in the base, and half of its length, all in mm. The housing has
# two half axes instead of its ends, half of its diagonal instead of half of its length, and the third half axis.
_MIDDLE, _HALF_LENGTH, _THIRD = 6, 9, 10
PLACED = 13
"""Columns of the table of placed bodies."""


# Kernels take numbers and arrays, not the model. Each array taken from a tuple, and each view of an array, is a counted
# reference, which takes longer than the arithmetic.


@kernel
def place_bodies(
    bodies: FloatArray, frames: FloatArray, beam_mm: float, first: int, last: int, placed: FloatArray
) -> None:
    """Write the ends of the bodies that move with the frames `first` to `last`, in the base, to `placed`.

    Args:
        bodies: see `CollisionModel`.
        frames: `(7, 3, 4)`, see `planner.kinematics.arm.link_frames`.
        beam_mm: length of the beam.
        first: first frame.
        last: last frame.
        placed: output `(n_bodies, PLACED)`: x y z of the start, the end and the middle, and half of the length; for the
            housing, see the columns.
    """
    for body in range(len(bodies)):
        f = int(bodies[body, FRAME])
        if not first <= f <= last:
            continue
        if body == len(bodies) - 2:
            _place_housing(bodies, body, frames, placed)
            continue
        half2 = 0.0
        for row in range(3):
            r0, r1, r2, origin = frames[f, row, 0], frames[f, row, 1], frames[f, row, 2], frames[f, row, 3]
            start = r0 * bodies[body, START] + r1 * bodies[body, START + 1] + r2 * bodies[body, START + 2]
            end = r0 * bodies[body, END] + r1 * bodies[body, END + 1] + r2 * bodies[body, END + 2]
            if body == len(bodies) - 1:
                end = start + beam_mm * (end - start)
            placed[body, row] = start + origin
            placed[body, 3 + row] = end + origin
            placed[body, _MIDDLE + row] = 0.5 * (start + end) + origin
            half2 += 0.25 * (end - start) * (end - start)
        placed[body, _HALF_LENGTH] = sqrt(half2)


@kernel
def _place_housing(bodies: FloatArray, body: int, frames: FloatArray, placed: FloatArray) -> None:
    f = int(bodies[body, FRAME])
    for row in range(3):
        r0, r1, r2 = frames[f, row, 0], frames[f, row, 1], frames[f, row, 2]
        for at, column in ((0, START), (3, END), (_MIDDLE, MIDDLE)):
            placed[body, at + row] = (
                r0 * bodies[body, column] + r1 * bodies[body, column + 1] + r2 * bodies[body, column + 2]
            )
        placed[body, _MIDDLE + row] += frames[f, row, 3]
    ux, uy, uz = placed[body, 0], placed[body, 1], placed[body, 2]
    vx, vy, vz = placed[body, 3], placed[body, 4], placed[body, 5]
    u2, v2, w = ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz, bodies[body, THIRD]
    scale = w / sqrt(u2 * v2)
    placed[body, _THIRD] = scale * (uy * vz - uz * vy)
    placed[body, _THIRD + 1] = scale * (uz * vx - ux * vz)
    placed[body, _THIRD + 2] = scale * (ux * vy - uy * vx)
    placed[body, _HALF_LENGTH] = sqrt(u2 + v2 + w * w)


@kernel
def nearest_pair(
    pairs: IndexArray, bodies: FloatArray, obstacles: FloatArray,
    field_values: npt.NDArray[np.float32], field_levels: FloatArray,
    placed: FloatArray, obstacle_frames: FloatArray, angle: int, first: int, last: int, enough_mm: float,
) -> tuple[float, int]:  # fmt: skip
    """Return the minimum clearance in mm of the pairs `first` to `last` - 1, and its pair.

    Clearances of `enough_mm` or more are not needed: if there is none below, that value and -1 are returned.

    Args:
        pairs: see `CollisionModel`.
        bodies: see `CollisionModel`.
        obstacles: see `CollisionModel`.
        field_values: values of the model's field.
        field_levels: its grids.
        placed: `(n_bodies, PLACED)`, see `place_bodies`.
        obstacle_frames: `(n_angles, n_obstacles, 3, 4)`, see `base_in_obstacles`.
        angle: index of the table angle.
        first: the first pair to check.
        last: the pair after the last one to check.
        enough_mm: the clearance that is sufficient.
    """
    beam = len(bodies) - 1
    least, nearest = enough_mm, -1
    for pair in range(first, last):
        body, other = pairs[pair, 0], pairs[pair, 1]
        radius = bodies[body, RADIUS]
        bound = min(least, 0.0) if body == beam else least
        if other <= beam:
            radius += bodies[other, RADIUS]
            if _spheres_apart(placed, body, other, bound + radius):
                continue
            if body == beam - 1:
                distance = _housing_distance(placed, body, other, bound + radius)
            else:
                distance = _body_distance(placed, body, other)
        else:
            i = other - beam - 1
            x, y, z = _in_frame(obstacle_frames, angle, i, placed, body, _MIDDLE)
            if _sphere_outside(obstacles, i, x, y, z, placed[body, _HALF_LENGTH] + bound + radius):
                continue
            if body == beam - 1:
                distance = _housing_from_obstacle(
                    obstacles, field_values, field_levels,
                    placed, body, obstacle_frames, angle, i, bound + radius,
                )  # fmt: skip
            else:
                distance = _body_from_obstacle(
                    obstacles, field_values, field_levels,
                    placed, body, obstacle_frames, angle, i, bound + radius,
                )  # fmt: skip
        # Not by the difference: it would return a distance that is only known to be sufficient for a smaller value.
        if distance < bound + radius:
            least, nearest = distance - radius, pair
    return least, nearest


@kernel
def _spheres_apart(placed: FloatArray, a: int, b: int, enough_mm: float) -> bool:
    """Return whether the spheres around two placed segments are at least `enough_mm` apart."""
    dx = placed[a, _MIDDLE] - placed[b, _MIDDLE]
    dy = placed[a, _MIDDLE + 1] - placed[b, _MIDDLE + 1]
    dz = placed[a, _MIDDLE + 2] - placed[b, _MIDDLE + 2]
    apart = placed[a, _HALF_LENGTH] + placed[b, _HALF_LENGTH] + enough_mm
    return bool(dx * dx + dy * dy + dz * dz >= apart * abs(apart))


@kernel
def _sphere_outside(obstacles: FloatArray, i: int, x: float, y: float, z: float, radius: float) -> bool:
    """Return whether a sphere is outside the box around an obstacle."""
    dx = max(obstacles[i, LOWER] - x, x - obstacles[i, UPPER], 0.0)
    dy = max(obstacles[i, LOWER + 1] - y, y - obstacles[i, UPPER + 1], 0.0)
    dz = max(obstacles[i, LOWER + 2] - z, z - obstacles[i, UPPER + 2], 0.0)
    outside2 = dx * dx + dy * dy + dz * dz
    return bool(outside2 > 0.0 and outside2 >= radius * abs(radius))


@kernel
def _body_distance(placed: FloatArray, a: int, b: int) -> float:
    return segment_distance(
        placed[a, 0], placed[a, 1], placed[a, 2], placed[a, 3], placed[a, 4], placed[a, 5],
        placed[b, 0], placed[b, 1], placed[b, 2], placed[b, 3], placed[b, 4], placed[b, 5],
    )  # fmt: skip


@kernel
def _body_from_obstacle(
    obstacles: FloatArray, field_values: npt.NDArray[np.float32], field_levels: FloatArray,
    placed: FloatArray, body: int, frames: FloatArray, angle: int, i: int, enough_mm: float,
) -> float:  # fmt: skip
    ax, ay, az = _in_frame(frames, angle, i, placed, body, 0)
    bx, by, bz = _in_frame(frames, angle, i, placed, body, 3)
    kind = int(obstacles[i, KIND])
    if kind == FIELD:
        return field_distance(field_values, field_levels, ax, ay, az, bx, by, bz, enough_mm)
    return solid_distance(
        kind, obstacles[i, SIZE], obstacles[i, SIZE + 1], obstacles[i, SIZE + 2],
        ax, ay, az, bx, by, bz, enough_mm,
    )  # fmt: skip


@kernel
def _housing_from_obstacle(
    obstacles: FloatArray, field_values: npt.NDArray[np.float32], field_levels: FloatArray,
    placed: FloatArray, housing: int, frames: FloatArray, angle: int, i: int, enough_mm: float,
) -> float:  # fmt: skip
    x, y, z = _in_frame(frames, angle, i, placed, housing, _MIDDLE)
    ux, uy, uz = _turned(frames, angle, i, placed, housing, 0)
    vx, vy, vz = _turned(frames, angle, i, placed, housing, 3)
    wx, wy, wz = _turned(frames, angle, i, placed, housing, _THIRD)
    return box_distance_bound(
        int(obstacles[i, KIND]), obstacles[i, SIZE], obstacles[i, SIZE + 1], obstacles[i, SIZE + 2],
        field_values, field_levels, x, y, z, ux, uy, uz, vx, vy, vz, wx, wy, wz, enough_mm,
    )  # fmt: skip


@kernel
def _housing_distance(placed: FloatArray, housing: int, body: int, enough_mm: float) -> float:
    """Return the distance of the housing from the segment of another body, like `solid_distance`."""
    ax, ay, az = _in_housing(placed, housing, body, 0)
    bx, by, bz = _in_housing(placed, housing, body, 3)
    return solid_distance(
        BOX, _length(placed, housing, 0), _length(placed, housing, 3), _length(placed, housing, _THIRD),
        ax, ay, az, bx, by, bz, enough_mm,
    )  # fmt: skip


@kernel
def _length(placed: FloatArray, body: int, at: int) -> float:
    x, y, z = placed[body, at], placed[body, at + 1], placed[body, at + 2]
    return sqrt(x * x + y * y + z * z)


@kernel
def _in_housing(placed: FloatArray, housing: int, body: int, at: int) -> tuple[float, float, float]:
    """Return a point of a placed body, from column `at` on, in the housing's frame."""
    x = placed[body, at] - placed[housing, _MIDDLE]
    y = placed[body, at + 1] - placed[housing, _MIDDLE + 1]
    z = placed[body, at + 2] - placed[housing, _MIDDLE + 2]
    return (
        _along(placed, housing, 0, x, y, z),
        _along(placed, housing, 3, x, y, z),
        _along(placed, housing, _THIRD, x, y, z),
    )


@kernel
def _along(placed: FloatArray, housing: int, at: int, x: float, y: float, z: float) -> float:
    along = x * placed[housing, at] + y * placed[housing, at + 1] + z * placed[housing, at + 2]
    return float(along / _length(placed, housing, at))


@kernel
def _turned(
    frames: FloatArray, angle: int, i: int, placed: FloatArray, body: int, at: int
) -> tuple[float, float, float]:
    """Return a vector of a placed body, from column `at` on, in the frame of obstacle `i`."""
    x, y, z = placed[body, at], placed[body, at + 1], placed[body, at + 2]
    return (
        frames[angle, i, 0, 0] * x + frames[angle, i, 0, 1] * y + frames[angle, i, 0, 2] * z,
        frames[angle, i, 1, 0] * x + frames[angle, i, 1, 1] * y + frames[angle, i, 1, 2] * z,
        frames[angle, i, 2, 0] * x + frames[angle, i, 2, 1] * y + frames[angle, i, 2, 2] * z,
    )


@kernel
def _in_frame(
    frames: FloatArray, angle: int, i: int, placed: FloatArray, body: int, at: int
) -> tuple[float, float, float]:
    """Return a point of a placed body, from column `at` on, in the frame of obstacle `i`."""
    x, y, z = placed[body, at], placed[body, at + 1], placed[body, at + 2]
    return (
        frames[angle, i, 0, 0] * x + frames[angle, i, 0, 1] * y + frames[angle, i, 0, 2] * z + frames[angle, i, 0, 3],
        frames[angle, i, 1, 0] * x + frames[angle, i, 1, 1] * y + frames[angle, i, 1, 2] * z + frames[angle, i, 1, 3],
        frames[angle, i, 2, 0] * x + frames[angle, i, 2, 1] * y + frames[angle, i, 2, 2] * z + frames[angle, i, 2, 3],
    )
