"""A shaded orthographic view of a part from one side, with its visible points in color."""

from itertools import product
from typing import NamedTuple

import numpy as np
import trimesh

from planner.arrays import FloatArray, IndexArray
from planner.geometry.ray_casting import RayCaster

VIEWS = ((-60.0, 35.0), (120.0, 35.0))
"""Direction of the view: azimuth and elevation in deg."""
_WIDTH, _HEIGHT = 700, 560
# Rows of a picture that are cast at once, which bounds the memory.
_ROWS_AT_ONCE = 40
# A point this far below the surface still counts as visible.
_ON_SURFACE_MM = 1.0
BARE = np.array((0.80, 0.81, 0.83))
"""The color of the part without points in full light."""

Image = FloatArray
PixelArray = IndexArray


class View(NamedTuple):
    """An orthographic view: its axes, the middle of the picture, and mm per pixel."""

    right: FloatArray
    up: FloatArray
    ahead: FloatArray
    middle: FloatArray
    pixel_mm: float
    span_mm: float

    @classmethod
    def of(cls, mesh: trimesh.Trimesh, azimuth_deg: float, elevation_deg: float) -> "View":
        """Return the view that contains a whole mesh."""
        azimuth, elevation = np.radians((azimuth_deg, elevation_deg))
        ahead = -np.array((np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)))
        right = np.cross(ahead, (0.0, 0.0, 1.0))
        right /= np.linalg.norm(right)
        up = np.cross(right, ahead)
        corners = np.array(list(product(*np.asarray(mesh.bounds).T)))
        middle = corners.mean(axis=0)
        wide, high = (np.ptp(corners @ axis) for axis in (right, up))
        pixel_mm = 1.06 * max(wide / _WIDTH, high / _HEIGHT)
        return cls(right, up, ahead, middle, float(pixel_mm), 2.0 * float(np.linalg.norm(mesh.extents)))

    def pixels(self, points: FloatArray) -> tuple[PixelArray, PixelArray, FloatArray]:
        """Return row, column and depth of points `(n, 3)`."""
        off = points - self.middle
        column = np.floor(off @ self.right / self.pixel_mm + 0.5 * _WIDTH).astype(np.int64)
        row = np.floor(0.5 * _HEIGHT - off @ self.up / self.pixel_mm).astype(np.int64)
        return row, column, off @ self.ahead + 0.5 * self.span_mm

    def surface(self, caster: RayCaster) -> tuple[Image, FloatArray]:
        """Return the shaded part without points, `(h, w, 3)`, and its depth `(h, w)`, NaN beside it."""
        image, depths_mm = np.ones((_HEIGHT, _WIDTH, 3)), np.empty((_HEIGHT, _WIDTH))
        light = self.up + 0.4 * self.right - 1.2 * self.ahead
        x = (np.arange(_WIDTH) + 0.5 - 0.5 * _WIDTH) * self.pixel_mm
        start = self.middle - 0.5 * self.span_mm * self.ahead + x[:, np.newaxis] * self.right
        for first in range(0, _HEIGHT, _ROWS_AT_ONCE):
            rows = np.arange(first, min(first + _ROWS_AT_ONCE, _HEIGHT))
            y = (0.5 * _HEIGHT - rows - 0.5) * self.pixel_mm
            origins = (start + y[:, np.newaxis, np.newaxis] * self.up).reshape(-1, 3)
            hits = caster.first_hits(origins, np.tile(self.ahead, (len(origins), 1)))
            facing = caster.normals[hits.triangles] @ (light / np.linalg.norm(light))
            shade = np.where(hits.triangles >= 0, 0.62 + 0.38 * np.clip(facing, 0, 1), np.nan).reshape(-1, _WIDTH, 1)
            image[rows] = np.where(np.isnan(shade), 1.0, shade * BARE)
            depths_mm[rows] = hits.distances_mm.reshape(-1, _WIDTH)
        return image, depths_mm

    def seen(
        self, points: FloatArray, depths_mm: FloatArray, size: int = 1, shift: tuple[int, int] = (0, 0)
    ) -> tuple[PixelArray, PixelArray, PixelArray]:
        """Return row, column and number of the points that are in the picture and not behind the surface in it.

        Args:
            points: `(n, 3)`.
            depths_mm: depth of the surface, from `surface`.
            size: size of a point in pixels; points within the slope of the surface inside it are visible.
            shift: rows and columns from the point's own pixel to the one that is tested.
        """
        row, column, depth_mm = self.pixels(points)
        row, column = row + shift[0], column + shift[1]
        number = np.flatnonzero((row >= 0) & (row < _HEIGHT) & (column >= 0) & (column < _WIDTH))
        allowed_mm = depths_mm[row[number], column[number]] + _ON_SURFACE_MM + size * self.pixel_mm
        number = number[depth_mm[number] <= allowed_mm]
        return row[number], column[number], number


def painted(view: View, caster: RayCaster, points: FloatArray, colors: FloatArray, size: int) -> Image:
    """Return the part with its visible points, as squares of `size` pixels."""
    image, depths_mm = view.surface(caster)
    shade = np.clip(image / BARE, 0.0, 1.0)
    shifts = range(-(size // 2), size - size // 2)
    for shift in product(shifts, shifts):
        row, column, number = view.seen(points, depths_mm, size, shift)
        image[row, column] = colors[number] * shade[row, column]
    return np.clip(image, 0.0, 1.0)
