"""Pictures of a scan: the cloud on the part, the part's coverage, and where the error comes from."""

from itertools import product
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
import trimesh
from matplotlib.axes import Axes
from matplotlib.colors import Normalize, to_rgb
from matplotlib.figure import Figure

from planner.arrays import FloatArray, IndexArray
from planner.geometry.ray_casting import RayCaster
from planner.scanning.coverage import Coverage
from planner.scanning.error_account import Account
from planner.scanning.probe import Sight

# From where the part is looked at: azimuth and elevation in deg.
_VIEWS = ((-60.0, 35.0), (120.0, 35.0))
_WIDTH, _HEIGHT = 700, 560
# So many rows of a picture are cast at once, which bounds the memory.
_ROWS_AT_ONCE = 40
# A point this far below the surface is still on it.
_ON_SURFACE_MM = 1.0
_BARE = np.array((0.80, 0.81, 0.83))
_STATE_COLOURS = {
    Sight.SEEN: "#3d8f5f",
    Sight.NEVER_IN_VIEW: "#7d8793",
    Sight.OUT_OF_RANGE: "#2f6fb0",
    Sight.INCIDENCE: "#d99a2b",
    Sight.OCCLUDED: "#b3362b",
}
STATE_NAMES = {
    Sight.SEEN: "seen",
    Sight.NEVER_IN_VIEW: "never in view",
    Sight.OUT_OF_RANGE: "out of reach",
    Sight.INCIDENCE: "incidence",
    Sight.OCCLUDED: "occluded",
}
_STYLE: dict[Any, Any] = {
    "font.size": 9.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "#5a616a",
    "figure.facecolor": "white",
}

Image = FloatArray
PixelArray = IndexArray


class _View(NamedTuple):
    """An orthographic view: its axes, the middle of the picture, and mm per pixel."""

    right: FloatArray
    up: FloatArray
    ahead: FloatArray
    middle: FloatArray
    pixel_mm: float
    span_mm: float

    @classmethod
    def of(cls, mesh: trimesh.Trimesh, azimuth_deg: float, elevation_deg: float) -> "_View":
        """Return the view that shows all of a mesh."""
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
        """Return the bare part, shaded, `(h, w, 3)`, and its depth `(h, w)`, NaN beside it."""
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
            image[rows] = np.where(np.isnan(shade), 1.0, shade * _BARE)
            depths_mm[rows] = hits.distances_mm.reshape(-1, _WIDTH)
        return image, depths_mm


def _painted(view: _View, caster: RayCaster, points: FloatArray, colours: FloatArray, size: int) -> Image:
    """Return the part with those of the points that are not behind it, as squares of `size` pixels."""
    image, depths_mm = view.surface(caster)
    shade = image / _BARE
    row, column, depth_mm = view.pixels(points)
    for down in range(size):
        for along in range(size):
            r, c = row + down - size // 2, column + along - size // 2
            inside = (r >= 0) & (r < _HEIGHT) & (c >= 0) & (c < _WIDTH)
            r, c, chosen = r[inside], c[inside], np.flatnonzero(inside)
            # The slope of the surface within a square counts as on it.
            before = depth_mm[chosen] <= depths_mm[r, c] + _ON_SURFACE_MM + size * view.pixel_mm
            r, c, chosen = r[before], c[before], chosen[before]
            image[r, c] = colours[chosen] * np.clip(shade[r, c], 0.0, 1.0)
    return np.clip(image, 0.0, 1.0)


def _show(axes: Axes, image: Image) -> None:
    axes.imshow(image, interpolation="antialiased")
    axes.set_axis_off()


def cloud_figure(mesh: trimesh.Trimesh, account: Account) -> Figure:
    """Return the cloud on the bare part, from two sides, coloured by its distance from the surface."""
    caster = RayCaster(mesh)
    limit_um = max(1.0, float(np.percentile(np.abs(account.errors_mm), 99.0)) * 1e3)
    norm, colours = Normalize(-limit_um, limit_um), mpl.colormaps["RdYlBu_r"]
    painted = np.asarray(colours(norm(account.errors_mm * 1e3)))[:, :3]
    with mpl.rc_context(_STYLE):
        figure = Figure(figsize=(9.6, 3.7), layout="constrained")
        both = figure.subplots(1, len(_VIEWS))
        for axes, (azimuth, elevation) in zip(both, _VIEWS, strict=True):
            _show(axes, _painted(_View.of(mesh, azimuth, elevation), caster, account.points_W, painted, 3))
        bar = figure.colorbar(mpl.cm.ScalarMappable(norm, colours), ax=both, shrink=0.75, aspect=28, pad=0.02)
        bar.set_label("distance from the surface (µm), outward +")
    return figure


def coverage_figure(mesh: trimesh.Trimesh, coverage: Coverage) -> Figure:
    """Return the part with its sample points, coloured by how far they came to being measured."""
    caster = RayCaster(mesh)
    colours = np.array([to_rgb(_STATE_COLOURS[Sight(code)]) for code in coverage.codes])
    shares = coverage.shares()
    with mpl.rc_context(_STYLE):
        figure = Figure(figsize=(9.6, 4.1), layout="constrained")
        both = figure.subplots(1, len(_VIEWS))
        for axes, (azimuth, elevation) in zip(both, _VIEWS, strict=True):
            _show(axes, _painted(_View.of(mesh, azimuth, elevation), caster, coverage.points, colours, 5))
        handles = [
            mpl.patches.Patch(color=_STATE_COLOURS[code], label=f"{STATE_NAMES[code]} {shares[code]:.1%}")
            for code in _STATE_COLOURS
            if shares[code] > 0.0
        ]
        figure.legend(handles=handles, loc="outside lower center", ncols=len(handles), frameon=False)
    return figure


def account_figure(account: Account) -> Figure:
    """Return how far each part alone moves the points, and how the distances are distributed."""
    with mpl.rc_context(_STYLE):
        figure = Figure(figsize=(9.6, 3.3), layout="constrained")
        bars, spread = figure.subplots(1, 2, width_ratios=(1.15, 1.0))
        names = [*account.parts, "all together"]
        shares = [*((part.displacement_mm, part.across_mm) for part in account.parts.values()), account.total]
        place = np.arange(len(names))[::-1]
        bars.barh(place + 0.19, [1e3 * moved for moved, _ in shares], 0.36, color="#2f6fb0", label="displacement")
        bars.barh(
            place - 0.19,
            [1e3 * across for _, across in shares],
            0.36,
            color="#d99a2b",
            label="of it across the surface",
        )
        bars.set_yticks(place, names)
        bars.set_xlabel("root mean square (µm)")
        bars.legend(frameon=False, loc="best")
        errors_um = 1e3 * account.errors_mm
        mean, sigma = 1e3 * account.distances.mean, 1e3 * account.distances.sigma
        span = max(4.0 * sigma, 1e-3)
        grid = np.linspace(mean - span, mean + span, 81)
        spread.hist(errors_um, bins=grid, density=True, color="#c9d3de")
        normal = np.exp(-0.5 * ((grid - mean) / max(sigma, 1e-9)) ** 2) / (max(sigma, 1e-9) * np.sqrt(2.0 * np.pi))
        spread.plot(grid, normal, color="#23272d", linewidth=1.0, label=f"normal, sigma {sigma:.1f} µm")
        spread.set_xlabel("distance from the surface (µm)")
        spread.set_yticks([])
        spread.legend(frameon=False, loc="upper right")
    return figure
