"""The plot of a cloud's deviation: the signed distance from the surface, averaged locally, with scale and axes.

A part that is round around an axis is unrolled: its wall over angle and height, and its ends in the direction of the
axis. Any other part is shown from two sides.
"""

from typing import Literal, NamedTuple

import matplotlib as mpl
import numpy as np
import trimesh
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from scipy.ndimage import gaussian_filter
from scipy.spatial import cKDTree

from planner.arrays import FloatArray, IndexArray
from planner.geometry.ray_casting import RayCaster
from planner.plot_style import new_figure, styled
from planner.scanning.error_budget import ErrorBudget
from planner.scanning.part_view import BARE, VIEWS, View

_SIGMA_CELLS = 4.0
"""Sigma of the Gaussian weights of the average, in cells of a picture."""
_CELLS = 280
"""Number of cells along the longer side of a picture."""
_ROUND_SHARE, _SIDEWAYS = 0.98, 0.1
"""A part is round if this share of its area has normals with a circumferential component below the given one."""
_END_SLOPE = 0.8
"""A surface whose normal has this component along the axis is an end and not the wall."""
_LEAST_SHARE = 0.01
"""A panel with a smaller share of the points is omitted."""
_COLORS = mpl.colormaps["RdYlBu_r"]


class Panel(NamedTuple):
    """A picture of deviations: `(rows, columns)` from the lower left corner upward, NaN without measurements.

    Attributes:
        deviation_um: averaged deviation.
        extent: left, right, bottom and top, in the units of the axes.
        title: title of the view.
        labels: labels of the axes, to the right and upward.
        bare: RGB picture of the part below, or None.
    """

    deviation_um: FloatArray
    extent: tuple[float, float, float, float]
    title: str
    labels: tuple[str, str]
    bare: FloatArray | None = None


@styled()
def deviation_figure(mesh: trimesh.Trimesh, budget: ErrorBudget) -> Figure:
    """Return the deviation of a cloud from its part: unrolled if that is round, else from two sides."""
    points, errors_um = budget.points_W, 1e3 * budget.errors_mm
    axis = axis_of_revolution(mesh)
    panels = _seen(mesh, points, errors_um) if axis is None else unrolled(mesh, axis, points, errors_um)
    shown = np.concatenate([panel.deviation_um[np.isfinite(panel.deviation_um)] for panel in panels])
    limit_um = max(1.0, float(np.percentile(np.abs(shown), 99.0)))
    norm = Normalize(-limit_um, limit_um)
    figure = new_figure(3.9)
    ratios = [1.0 if panel.labels[0].endswith("(mm)") else 2.0 for panel in panels]
    row = figure.subplots(1, len(panels), width_ratios=ratios, squeeze=False)[0]
    for axes, panel in zip(row, panels, strict=True):
        _draw(axes, panel, norm)
    bar = figure.colorbar(ScalarMappable(norm, _COLORS), ax=list(row), shrink=0.85, pad=0.02)
    bar.set_label("mean deviation (µm), outward +")
    return figure


def axis_of_revolution(mesh: trimesh.Trimesh) -> FloatArray | None:
    """Return the axis `(3,)` through the middle around which a part is round; None if there is none.

    On a surface of revolution no normal has a component along the circumference.
    """
    area, off = mesh.area_faces / mesh.area, mesh.triangles_center - mesh.centroid
    principal = np.linalg.eigh((off * area[:, np.newaxis]).T @ off)[1].T
    for axis in (*np.eye(3)[::-1], *principal):
        along = np.cross(axis, off)
        length = np.linalg.norm(along, axis=1, keepdims=True)
        sideways = np.abs(np.sum(mesh.face_normals * along / np.maximum(length, 1e-9), axis=1))
        if area[sideways < _SIDEWAYS].sum() >= _ROUND_SHARE:
            return np.asarray(axis)
    return None


def unrolled(mesh: trimesh.Trimesh, axis: FloatArray, points: FloatArray, errors_um: FloatArray) -> list[Panel]:
    """Return the wall of a round part over angle and height, and those of its ends that were measured."""
    surface, faces = trimesh.sample.sample_surface(mesh, 20_000, seed=0)
    slope = mesh.face_normals[faces[cKDTree(surface).query(points)[1]]] @ axis
    # Angles are counted from x, or from the nearest axis that is perpendicular.
    x = np.eye(3)[np.argmin(np.abs(axis))]
    x = x - (x @ axis) * axis
    x /= np.linalg.norm(x)
    off = points - mesh.centroid
    right, up, height = off @ x, off @ np.cross(axis, x), points @ axis
    angle_deg = np.degrees(np.arctan2(up, right)) % 360.0
    parts = (
        (
            "wall, unrolled",
            np.abs(slope) < _END_SLOPE,
            angle_deg,
            height,
            ("angle about the axis (deg)", "height (mm)"),
        ),
        ("end, from above", slope >= _END_SLOPE, right, up, ("x (mm)", "y (mm)")),
        ("end, from below", slope <= -_END_SLOPE, right, -up, ("x (mm)", "-y (mm)")),
    )
    return [
        _panel(title, labels, across[chosen], upwards[chosen], errors_um[chosen], is_round=across is angle_deg)
        for title, chosen, across, upwards, labels in parts
        if chosen.mean() >= _LEAST_SHARE
    ]


def _panel(
    title: str, labels: tuple[str, str], x: FloatArray, y: FloatArray, errors_um: FloatArray, *, is_round: bool
) -> Panel:
    left, right = (0.0, 360.0) if is_round else (float(x.min()), float(x.max()))
    bottom, top = float(y.min()), float(y.max())
    top = max(top, bottom + 1e-3)
    columns, rows = _CELLS, _CELLS // 2
    if not is_round:
        cell = max(right - left, top - bottom) / _CELLS
        columns, rows = (max(1, int(np.ceil(span / cell))) for span in (right - left, top - bottom))
    column = np.clip(((x - left) / (right - left) * columns).astype(np.int64), 0, columns - 1)
    row = np.clip(((y - bottom) / (top - bottom) * rows).astype(np.int64), 0, rows - 1)
    averaged = smoothed(row * columns + column, errors_um, (rows, columns), is_round=is_round)
    return Panel(averaged, (left, right, bottom, top), title, labels)


def smoothed(cells: IndexArray, errors_um: FloatArray, shape: tuple[int, int], *, is_round: bool = False) -> FloatArray:
    """Return the average with Gaussian weights over the cells of a picture; NaN more than two sigmas from all points.

    Args:
        cells: `(n,)` cell of each point, row by row.
        errors_um: `(n,)` values to average.
        shape: rows and columns.
        is_round: whether the last column is adjacent to the first one.
    """
    mode: tuple[Literal["nearest"], Literal["nearest", "wrap"]] = ("nearest", "wrap" if is_round else "nearest")
    totals = (np.bincount(cells, weights, shape[0] * shape[1]) for weights in (errors_um, np.ones(len(cells))))
    sums, counts = (gaussian_filter(total.reshape(shape), _SIGMA_CELLS, mode=mode) for total in totals)
    lone = np.exp(-2.0) / (2.0 * np.pi * _SIGMA_CELLS**2)
    return np.where(counts >= lone, sums / np.maximum(counts, 1e-12), np.nan)


def _seen(mesh: trimesh.Trimesh, points: FloatArray, errors_um: FloatArray) -> list[Panel]:
    """Return a part from two sides, with the points that are visible from there."""
    caster, panels = RayCaster(mesh), []
    for azimuth_deg, elevation_deg in VIEWS:
        view = View.of(mesh, azimuth_deg, elevation_deg)
        bare, depths_mm = view.surface(caster)
        rows, columns = depths_mm.shape
        row, column, chosen = view.seen(points, depths_mm)
        deviation = smoothed(row * columns + column, errors_um[chosen], (rows, columns))
        half_high, half_wide = 0.5 * view.pixel_mm * rows, 0.5 * view.pixel_mm * columns
        panels.append(
            Panel(
                np.where(np.isfinite(depths_mm), deviation, np.nan)[::-1],
                (-half_wide, half_wide, -half_high, half_high),
                f"from azimuth {azimuth_deg:g} deg, elevation {elevation_deg:g} deg",
                ("to the right (mm)", "upwards in the view (mm)"),
                bare[::-1],
            )
        )
    return panels


def _draw(axes: Axes, panel: Panel, norm: Normalize) -> None:
    measured = np.isfinite(panel.deviation_um)
    image = np.asarray(_COLORS(norm(np.where(measured, panel.deviation_um, 0.0))))[:, :, :3]
    below = np.broadcast_to(BARE, image.shape) if panel.bare is None else panel.bare
    shade = 1.0 if panel.bare is None else below / BARE
    aspect: Literal["equal", "auto"] = "equal" if panel.labels[0].endswith("(mm)") else "auto"
    axes.imshow(
        np.clip(np.where(measured[:, :, np.newaxis], image * shade, below), 0.0, 1.0),
        origin="lower",
        extent=panel.extent,
        aspect=aspect,
    )
    axes.grid(visible=False)
    axes.set(title=panel.title, xlabel=panel.labels[0], ylabel=panel.labels[1])
    if aspect == "auto":
        axes.set_xticks(range(0, 361, 60))
