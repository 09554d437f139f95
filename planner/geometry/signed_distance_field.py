"""The signed distance of a mesh on nested regular grids: positive outside, negative inside, in mm.

The distance to the nearest triangle is exact. The sign is that of the winding number along each line of a grid. A field
is computed once and stored on disk under the digest of the mesh and the resolution. Kernels read it.
"""

import hashlib
import io
import zipfile
from math import hypot, sqrt
from pathlib import Path
from typing import NamedTuple

import numpy as np
import trimesh
from numpy.typing import NDArray

from planner.arrays import FloatArray, IndexArray
from planner.geometry.bounding_volume_hierarchy import bounding_volume_hierarchy, nearest_triangle
from planner.geometry.shells import turned_outward
from planner.geometry.winding_number import BESIDE, winding_numbers
from planner.kernel import kernel
from protocol.kernels.kept_file import FIELD, cache_root, keep_file, load_file
from protocol.program.progress import Progress

_MOST_POINTS = 4_000_000
_RULES = b"nested grids, any winding, signs by the nesting of shells"
"""Part of the name of a stored field, so that fields of other versions are not read."""
_COARSER = 3
"""Ratio of the spacings of a level and the next finer one."""
_BESIDE_POINTS = 5
"""Number of points by which a level extends beyond the previous one, on each side."""
_REACH_MM = 300.0
"""Distance by which the levels extend beyond the mesh: the radius of an arm's part, plus a comfortable clearance."""
_SPACING, _SHAPE = 3, 4
"""Columns of the levels."""
_STEP = 0.25
"""Minimum step of the walk along a segment, in grid spacings."""


class SignedDistanceField(NamedTuple):
    """Signed distances on nested grids: a fine one around the mesh, and coarser ones with a larger extent.

    Attributes:
        values_mm: `(n,)` float32, the signed distances at the grids' points, grid after grid, z running fastest.
        levels: `(n_levels, 7)`, for each grid its first point in the mesh's frame and its spacing, both in mm, and its
            size. The size is the number of points along x, y and z. The finest grid is first.
    """

    values_mm: NDArray[np.float32]
    levels: FloatArray

    @property
    def spacing_mm(self) -> float:
        """The spacing of the finest grid."""
        return float(self.levels[0, _SPACING])

    def finest(self) -> tuple[NDArray[np.float32], FloatArray]:
        """Return the finest grid's values `(nx, ny, nz)` and its first point `(3,)`."""
        shape = self.levels[0, _SHAPE:].astype(int)
        return self.values_mm[: np.prod(shape)].reshape(shape), self.levels[0, :_SPACING]


NO_FIELD = SignedDistanceField(np.zeros(8, np.float32), np.array([[0.0, 0.0, 0.0, 1.0, 2.0, 2.0, 2.0]]))
"""The field for kernels if no part is a mesh."""


def build_field(mesh: trimesh.Trimesh, spacing_mm: float, progress: Progress | None = None) -> SignedDistanceField:
    """Return the signed distance field of a watertight mesh. The finest grid extends one cell beyond it on each side.

    The values are exact to the rounding of float32. The exception are points outside within a thousandth of the spacing
    of the surface, which count as inside. So no value is above the true one. The nesting of the shells determines the
    inside (see `planner.geometry.shells`), for any orientation of the triangles.

    Args:
        mesh: the mesh, in mm.
        spacing_mm: spacing of the finest grid.
        progress: called with the number of finished points and of all points, between blocks.

    Raises:
        ValueError: the spacing is not positive, or so small that the grid would not fit in memory.
        WorkpieceError: the surface has no inside.
    """
    if not spacing_mm > 0.0:
        raise ValueError(f"the spacing of a distance field is {spacing_mm:g} mm; it must be above 0")
    lower, upper = np.asarray(mesh.bounds, dtype=np.float64)
    shape = np.ceil((upper - lower) / spacing_mm).astype(int) + 3
    if np.prod(shape.astype(float)) > _MOST_POINTS:
        raise ValueError(
            f"a distance field of {shape[0]} x {shape[1]} x {shape[2]} points is too large; choose a spacing above "
            f"{spacing_mm:g} mm"
        )
    levels = _levels((lower + upper) / 2, shape, spacing_mm)
    sizes = levels[:, _SHAPE:].prod(axis=1).astype(int)
    values = np.empty(sizes.sum(), dtype=np.float32)
    triangles = np.array(mesh.triangles, dtype=np.float64)
    hierarchy = bounding_volume_hierarchy(triangles)
    turned = turned_outward(np.asarray(mesh.vertices), np.asarray(mesh.faces))
    triangles[turned] = triangles[turned, ::-1]
    done = 0
    for level, of_level in zip(levels, np.split(values, np.cumsum(sizes)[:-1]), strict=True):
        origin, spacing = level[:_SPACING], float(level[_SPACING])
        grid = of_level.reshape(level[_SHAPE:].astype(int))
        for i in range(len(grid)):
            _write_distances(hierarchy.triangles, hierarchy.boxes, origin, spacing, i, grid[i])
            done += grid[i].size
            if progress is not None:
                progress(done, values.size)
        # A value below 0 is in a body that shares a wall with another one and is inside out relative to it.
        inside = winding_numbers(triangles, origin, spacing, grid.shape) != 0
        inside |= grid < hypot(*BESIDE) * spacing
        grid[inside] *= -1.0
    return SignedDistanceField(values, levels)


def _levels(middle: FloatArray, shape: IndexArray, spacing_mm: float) -> FloatArray:
    """Return the levels of a field around `middle` `(3,)`, the finest one with `shape` `(3,)` points."""
    levels = []
    reach_mm = (shape - 1) * spacing_mm / 2 + _REACH_MM
    while True:
        half_mm = (shape - 1) * spacing_mm / 2
        levels.append((*(middle - half_mm), spacing_mm, *shape))
        if (half_mm >= reach_mm).all():
            return np.array(levels, dtype=np.float64)
        shape = -(-shape // _COARSER) + 2 * _BESIDE_POINTS
        spacing_mm *= _COARSER


@kernel
def _write_distances(
    triangles: FloatArray, boxes: FloatArray, origin: FloatArray, spacing: float, i: int, distances: NDArray[np.float32]
) -> None:
    """Write the distances in mm of the points `(i, 0..ny, 0..nz)` from the nearest triangle."""
    ny, nz = distances.shape
    nearest = 0
    for j in range(ny):
        for step in range(nz):
            # In alternating direction, so that the triangle nearest to the previous point is always near.
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
    """Return the field of `mesh`, read from `folder` if it was stored before (default: the user's cache)."""
    file = (folder or _cache_folder()) / f"{_digest(mesh, spacing_mm)}{FIELD}"
    stored = _load(file)
    if stored is not None:
        return stored
    field = build_field(mesh, spacing_mm, progress)
    content = io.BytesIO()
    np.savez(content, **field._asdict())
    keep_file(file, content.getvalue())
    return field


def _cache_folder() -> Path:
    return cache_root() / "distance-fields"


def _digest(mesh: trimesh.Trimesh, spacing_mm: float) -> str:
    content = hashlib.sha256(_RULES + np.float64(spacing_mm).tobytes())
    content.update(np.ascontiguousarray(mesh.vertices, dtype=np.float64).tobytes())
    content.update(np.ascontiguousarray(mesh.faces, dtype=np.int64).tobytes())
    return content.hexdigest()[:32]


def _load(file: Path) -> SignedDistanceField | None:
    """Return the stored field, or None if there is none that can be trusted: then it is computed again."""
    content = load_file(file)
    if content is None:
        return None
    try:
        with np.load(io.BytesIO(content)) as stored:
            return SignedDistanceField(stored["values_mm"], stored["levels"])
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None


@kernel
def look_up(values: NDArray[np.float32], levels: FloatArray, x: float, y: float, z: float) -> float:
    """Return a lower bound in mm of the signed distance at a point of the mesh's frame.

    Let w be the weights of trilinear interpolation in the finest grid that contains the point. Then e2 is the weighted
    mean of the squared distances from the cell's corners, at most 3/4 of a squared spacing. The error of the
    interpolated distance d is at most e. Far from the mesh the bound is better. The squared distance from any set,
    minus the squared length of the point's vector, is a minimum of linear functions and therefore concave. So the true
    distance is at least sqrt(d2 - e2). Beyond all grids, consider the nearest point of the coarsest grid's box. The
    distance to the mesh is the longest side of a triangle with an obtuse angle at that point.

    Args:
        values: see `SignedDistanceField`.
        levels: see `SignedDistanceField`.
        x: x of the point.
        y: y of the point.
        z: z of the point.
    """
    first, last = 0, len(levels) - 1
    for level in range(last + 1):
        spacing = levels[level, _SPACING]
        nx, ny, nz = int(levels[level, _SHAPE]), int(levels[level, _SHAPE + 1]), int(levels[level, _SHAPE + 2])
        gx, gy, gz = (
            (x - levels[level, 0]) / spacing,
            (y - levels[level, 1]) / spacing,
            (z - levels[level, 2]) / spacing,
        )
        if level == last or (0.0 <= gx <= nx - 1 and 0.0 <= gy <= ny - 1 and 0.0 <= gz <= nz - 1):
            break
        first += nx * ny * nz
    cx, cy, cz = min(max(gx, 0.0), nx - 1.0), min(max(gy, 0.0), ny - 1.0), min(max(gz, 0.0), nz - 1.0)
    i, j, k = min(int(cx), nx - 2), min(int(cy), ny - 2), min(int(cz), nz - 2)
    u, v, w = cx - i, cy - j, cz - k
    a = first + (i * ny + j) * nz + k
    b, c, d = a + ny * nz, a + nz, a + (ny + 1) * nz
    near = (1 - v) * ((1 - u) * values[a] + u * values[b]) + v * ((1 - u) * values[c] + u * values[d])
    a, b, c, d = a + 1, b + 1, c + 1, d + 1
    far = (1 - v) * ((1 - u) * values[a] + u * values[b]) + v * ((1 - u) * values[c] + u * values[d])
    distance = float((1 - w) * near + w * far)
    off2 = spacing * spacing * (u * (1 - u) + v * (1 - v) + w * (1 - w))
    far2 = distance * distance - off2
    bound = sqrt(far2) if far2 > 0.0 and distance > 0.0 else distance - sqrt(off2)
    if level == 0 and last > 0:
        return bound
    dx, dy, dz = (gx - cx) * spacing, (gy - cy) * spacing, (gz - cz) * spacing
    beyond2 = dx * dx + dy * dy + dz * dz
    if beyond2 > 0.0:
        bound = sqrt(beyond2 + max(bound, 0.0) ** 2)
    # The finest grid extends one cell beyond the mesh, so the box without its outermost cells contains the mesh.
    outside2 = _outside2(levels, x, y, z)
    return max(bound, sqrt(outside2)) if outside2 > 0.0 else bound


@kernel
def _outside2(levels: FloatArray, x: float, y: float, z: float) -> float:
    """Return the squared distance in mm2 of a point from the finest grid's box without its outermost cells."""
    inner = levels[0, _SPACING]
    dx = max(levels[0, 0] + inner - x, x - levels[0, 0] - (levels[0, _SHAPE] - 2.0) * inner, 0.0)
    dy = max(levels[0, 1] + inner - y, y - levels[0, 1] - (levels[0, _SHAPE + 1] - 2.0) * inner, 0.0)
    dz = max(levels[0, 2] + inner - z, z - levels[0, 2] - (levels[0, _SHAPE + 2] - 2.0) * inner, 0.0)
    return float(dx * dx + dy * dy + dz * dz)


@kernel
def field_distance(
    values: NDArray[np.float32], levels: FloatArray,
    ax: float, ay: float, az: float, bx: float, by: float, bz: float, enough_mm: float,
) -> float:  # fmt: skip
    """Return a lower bound in mm of the minimum signed distance of the segment a-b from the mesh.

    The bound is never above the true distance. If the segment is inside the finest grid, it is at most two spacings
    below. For a distance of `enough_mm` or more, the result is only known to be at least that. The walk goes from the
    middle to each end, in steps as large as the present distance allows: within the difference of the present and the
    minimum distance, there is no smaller distance, nor within that of the end.
    """
    ux, uy, uz = bx - ax, by - ay, bz - az
    length = sqrt(ux * ux + uy * uy + uz * uz)
    half, shortest = 0.5 * length, _STEP * levels[0, _SPACING]
    error = 0.5 * shortest
    middle = look_up(values, levels, ax + 0.5 * ux, ay + 0.5 * uy, az + 0.5 * uz)
    free = enough_mm + error
    least = min(free, middle)
    for end in (-0.5, 0.5):
        t = 0.5 + end
        last = look_up(values, levels, ax + t * ux, ay + t * uy, az + t * uz)
        least = min(least, last)
        along, value = 0.0, middle
        # The brackets are necessary: the result is at least `half` once `along` is, so that rounding cannot make the
        # walk endless.
        while along + ((value - least) + (last - least)) < half:
            along = min(along + max(value - least, shortest), half)
            t = 0.5 + end * (along / half)
            value = look_up(values, levels, ax + t * ux, ay + t * uy, az + t * uz)
            least = min(least, value)
    # `free - error` need not be `enough_mm`: in floating point it may be smaller, and would block a clear segment.
    return least - error if least < free else enough_mm
