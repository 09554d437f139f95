"""The signed distance of a mesh on a regular grid: positive outside, negative inside, in mm.

The distance is that of the nearest triangle, exactly; the sign is the winding number's along each line of the grid. A
field is built once and kept on disk under the mesh's content and the resolution; kernels look it up.
"""

import hashlib
import zipfile
from contextlib import suppress
from math import floor, hypot, sqrt
from pathlib import Path
from typing import NamedTuple

import numpy as np
import trimesh
from numpy.typing import NDArray

from planner.arrays import FloatArray
from planner.geometry.bounding_volume_hierarchy import bounding_volume_hierarchy, nearest_triangle
from planner.geometry.shells import turned_outward
from planner.geometry.winding_number import BESIDE, winding_numbers
from planner.kernel import cache_directory, kernel
from planner.progress import Progress
from planner.whole_file import whole_file

_MOST_POINTS = 4_000_000
_RULES = b"signs by the nesting of shells"
"""Part of a stored field's name, so that fields built by other rules are not read back."""
LOOK_UP_ERROR = 0.5 * sqrt(3.0)
"""What a look-up can be off, in grid spacings: half a cell's diagonal."""
_STEP = 0.25
"""Shortest stride of the walk along a segment, in grid spacings."""


class SignedDistanceField(NamedTuple):
    """A grid of signed distances.

    Attributes:
        values_mm: `(nx, ny, nz)` float32, the signed distance at the grid's points.
        origin_mm: `(3,)`, the grid's first point in the mesh's frame.
        spacing_mm: The distance between neighbouring points.
    """

    values_mm: NDArray[np.float32]
    origin_mm: FloatArray
    spacing_mm: float


NO_FIELD = SignedDistanceField(np.zeros((2, 2, 2), np.float32), np.zeros(3), 1.0)
"""What a kernel is handed where no part is a mesh."""


def build_field(mesh: trimesh.Trimesh, spacing_mm: float, progress: Progress | None = None) -> SignedDistanceField:
    """Return the signed distance field of a watertight mesh; the grid reaches a cell beyond it on each side.

    The values are exact to the rounding of float32, but for points outside within a thousandth of the spacing of the
    surface, which count as inside. So no value is above the true one. Which side of the surface is inside follows from
    how its shells are nested (see `planner.geometry.shells`), whichever way round their triangles are written.

    Args:
        mesh: The mesh, in mm.
        spacing_mm: The grid's spacing.
        progress: Called with the points done and all points, between blocks.

    Raises:
        ValueError: The spacing is not positive, or so small that the grid would not fit in memory.
        WorkpieceError: The surface has no inside.
    """
    if not spacing_mm > 0.0:
        raise ValueError(f"the spacing of a distance field is {spacing_mm:g} mm, it must be above 0")
    lower, upper = np.asarray(mesh.bounds, dtype=np.float64)
    shape = np.ceil((upper - lower) / spacing_mm).astype(int) + 3
    if np.prod(shape.astype(float)) > _MOST_POINTS:
        raise ValueError(
            f"a distance field of {shape[0]} x {shape[1]} x {shape[2]} points is too large, choose a spacing above "
            f"{spacing_mm:g} mm"
        )
    origin = (lower + upper) / 2 - (shape - 1) * spacing_mm / 2
    values = np.empty(tuple(shape), dtype=np.float32)
    triangles = np.array(mesh.triangles, dtype=np.float64)
    hierarchy = bounding_volume_hierarchy(triangles)
    for i in range(shape[0]):
        _write_distances(*hierarchy, origin, spacing_mm, i, values[i])
        if progress is not None:
            progress((i + 1) * values[0].size, values.size)
    turned = turned_outward(np.asarray(mesh.vertices), np.asarray(mesh.faces))
    triangles[turned] = triangles[turned, ::-1]
    inside = winding_numbers(triangles, origin, spacing_mm, values.shape) > 0
    inside |= values < hypot(*BESIDE) * spacing_mm
    values[inside] *= -1.0
    return SignedDistanceField(values, origin, spacing_mm)


@kernel
def _write_distances(
    triangles: FloatArray, boxes: FloatArray, origin: FloatArray, spacing: float, i: int, distances: NDArray[np.float32]
) -> None:
    """Write the distances in mm of the points `(i, 0..ny, 0..nz)` from the nearest triangle."""
    ny, nz = distances.shape
    nearest = 0
    for j in range(ny):
        for step in range(nz):
            # To and fro, so that the triangle nearest to the last point is always near.
            k = step if j % 2 == 0 else nz - 1 - step
            x, y, z = origin[0] + i * spacing, origin[1] + j * spacing, origin[2] + k * spacing
            distance2, nearest = nearest_triangle(triangles, boxes, x, y, z, nearest)
            distances[j, k] = sqrt(distance2)


def cached_field(
    mesh: trimesh.Trimesh,
    spacing_mm: float,
    progress: Progress | None = None,
    folder: Path | None = None,
) -> SignedDistanceField:
    """Return the field of `mesh`, read from `folder` if it was built before (default: the user's cache)."""
    file = (folder or _cache_folder()) / f"{_digest(mesh, spacing_mm)}.npz"
    stored = _load(file)
    if stored is not None:
        return stored
    field = build_field(mesh, spacing_mm, progress)
    # A folder that cannot be written costs the next run its time and this one nothing.
    with suppress(OSError):
        file.parent.mkdir(parents=True, exist_ok=True)
        with whole_file(file) as partial:
            np.savez(partial, **field._asdict())
    return field


def _cache_folder() -> Path:
    return cache_directory().parent / "distance-fields"


def _digest(mesh: trimesh.Trimesh, spacing_mm: float) -> str:
    content = hashlib.sha256(_RULES + np.float64(spacing_mm).tobytes())
    content.update(np.ascontiguousarray(mesh.vertices, dtype=np.float64).tobytes())
    content.update(np.ascontiguousarray(mesh.faces, dtype=np.int64).tobytes())
    return content.hexdigest()[:32]


def _load(file: Path) -> SignedDistanceField | None:
    """Return the stored field, or None where there is none or a damaged one: it is then built anew."""
    try:
        with file.open("rb") as content, np.load(content) as stored:
            return SignedDistanceField(stored["values_mm"], stored["origin_mm"], float(stored["spacing_mm"]))
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None


@kernel
def look_up(values: NDArray[np.float32], origin: FloatArray, spacing: float, x: float, y: float, z: float) -> float:
    """Return the signed distance in mm at a point of the mesh's frame.

    On the grid it is trilinear, so at most half a cell's diagonal off. Beyond it, it is a lower bound: the way to
    the mesh is the longest side of a triangle with a blunt angle at the nearest grid point. It ends in the mesh box.
    """
    nx, ny, nz = values.shape
    gx, gy, gz = (x - origin[0]) / spacing, (y - origin[1]) / spacing, (z - origin[2]) / spacing
    cx, cy, cz = min(max(gx, 0.0), nx - 1.0), min(max(gy, 0.0), ny - 1.0), min(max(gz, 0.0), nz - 1.0)
    i, j, k = min(floor(cx), nx - 2), min(floor(cy), ny - 2), min(floor(cz), nz - 2)
    u, v, w = cx - i, cy - j, cz - k
    near = (1 - u) * (1 - v) * values[i, j, k] + u * (1 - v) * values[i + 1, j, k]
    near += (1 - u) * v * values[i, j + 1, k] + u * v * values[i + 1, j + 1, k]
    far = (1 - u) * (1 - v) * values[i, j, k + 1] + u * (1 - v) * values[i + 1, j, k + 1]
    far += (1 - u) * v * values[i, j + 1, k + 1] + u * v * values[i + 1, j + 1, k + 1]
    inside = float((1 - w) * near + w * far)
    dx, dy, dz = (gx - cx) * spacing, (gy - cy) * spacing, (gz - cz) * spacing
    outside = dx * dx + dy * dy + dz * dz
    if outside == 0.0:
        return inside
    # The grid reaches a cell beyond the mesh on each side, so the box that it leaves within holds the mesh.
    bx, by, bz = max(1.0 - gx, gx - nx + 2.0, 0.0), max(1.0 - gy, gy - ny + 2.0, 0.0), max(1.0 - gz, gz - nz + 2.0, 0.0)
    return max(sqrt(outside + max(inside, 0.0) ** 2), spacing * sqrt(bx * bx + by * by + bz * bz))


@kernel
def field_distance(
    values: NDArray[np.float32], origin: FloatArray, spacing: float,
    ax: float, ay: float, az: float, bx: float, by: float, bz: float, enough_mm: float,
) -> float:  # fmt: skip
    """Return a lower bound in mm of the least signed distance of the segment a-b from the mesh.

    It is never above the true distance and, where the segment runs within the grid, at most two spacings below.
    Where the distance is `enough_mm` or more, the result is only known to be at least that. The walk goes from the
    middle towards each end and strides as far as the distance at hand allows: nothing nearer than the least one found
    can lie within the difference of the two, nor within that of the end.
    """
    ux, uy, uz = bx - ax, by - ay, bz - az
    length = sqrt(ux * ux + uy * uy + uz * uz)
    half, shortest = 0.5 * length, _STEP * spacing
    # Half a cell's diagonal from the look-up, half a shortest stride from the walk.
    error = (LOOK_UP_ERROR + 0.5 * _STEP) * spacing
    middle = look_up(values, origin, spacing, ax + 0.5 * ux, ay + 0.5 * uy, az + 0.5 * uz)
    free = enough_mm + error
    least = min(free, middle)
    for end in (-0.5, 0.5):
        t = 0.5 + end
        last = look_up(values, origin, spacing, ax + t * ux, ay + t * uy, az + t * uz)
        least = min(least, last)
        along, value = 0.0, middle
        # The brackets matter: no less than `half` once `along` is, so that rounding cannot keep the walk from ending.
        while along + ((value - least) + (last - least)) < half:
            along = min(along + max(value - least, shortest), half)
            t = 0.5 + end * (along / half)
            value = look_up(values, origin, spacing, ax + t * ux, ay + t * uy, az + t * uz)
            least = min(least, value)
    # `free - error` need not be `enough_mm`: in floating point it may be less, and would block a free segment.
    return least - error if least < free else enough_mm
