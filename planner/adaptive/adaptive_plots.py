"""Pictures of an adaptive scan: its strips on the part from several sides, and the coverage strip by strip."""

from itertools import pairwise

import matplotlib as mpl
import numpy as np
import trimesh
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, PercentFormatter

from planner.adaptive.adaptive_scan import AdaptiveScanned
from planner.arrays import FloatArray
from planner.geometry.ray_casting import RayCaster
from planner.plot_style import BLUE, GREEN, INK, LIMIT, PALE, SKY, VERMILION, new_figure, styled
from planner.scanning.part_view import View, painted

_AZIMUTHS_DEG = (-60.0, 30.0, 120.0, 210.0)
_ELEVATION_DEG = 30.0
_MAP = "viridis"
# The line of a strip behind the part is drawn fainter; what is so little behind the surface is on it.
_BEHIND = 0.25
_ON_SURFACE_MM = 3.0


@styled()
def strips_figure(scanned: AdaptiveScanned) -> Figure:
    """Return the part from four sides: where it was seen, by which strip first, and where the strips' middles run."""
    mesh, T_TW = _standing(scanned)
    caster = RayCaster(mesh)
    points = scanned.scanned.coverage.points @ T_TW[:3, :3].T + T_TW[:3, 3]
    colors = _colors(scanned)
    figure = new_figure(7.6)
    for axes, azimuth_deg in zip(figure.subplots(2, 2).ravel(), _AZIMUTHS_DEG, strict=True):
        view = View.of(mesh, azimuth_deg, _ELEVATION_DEG)
        axes.imshow(painted(view, caster, points, colors, 5), interpolation="antialiased")
        axes.set_axis_off()
        _, depths_mm = view.surface(caster)
        for number, strip in enumerate(scanned.strips, 1):
            _draw_line(axes, view, depths_mm, _middle_line(scanned, strip.plan.strip.T_WS, T_TW), number)
    handles = [mpl.patches.Patch(color=VERMILION, label="unseen")]
    if scanned.knows_visible:
        handles.append(mpl.patches.Patch(color=PALE, label="cannot be seen"))
    if scanned.path is not None:
        handles.insert(0, mpl.patches.Patch(color=SKY, label="seen along the path"))
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
    if scanned.strips:
        norm = mpl.colors.Normalize(1, max(2, len(scanned.strips)))
        bar = figure.colorbar(
            mpl.cm.ScalarMappable(norm, _MAP), ax=figure.axes, shrink=0.5, label="strip that saw it first"
        )
        bar.ax.yaxis.set_major_locator(MaxNLocator(integer=True))
    return figure


def _standing(scanned: AdaptiveScanned) -> tuple[trimesh.Trimesh, FloatArray]:
    """Return the part as it stands on the table, and how it was placed there `(4, 4)`."""
    T_TW = scanned.scanned.scan.cell.T_TW
    mesh = scanned.scanned.scan.mesh.copy()
    mesh.apply_transform(T_TW)
    return mesh, T_TW


def _colors(scanned: AdaptiveScanned) -> FloatArray:
    """Return the color of each place `(m, 3)`."""
    first = int(scanned.path is not None)
    steps = mpl.colormaps[_MAP](np.linspace(0.0, 1.0, max(2, len(scanned.strips))))[:, :3]
    colors = np.where(scanned.visible[:, np.newaxis], to_rgb(VERMILION), to_rgb(PALE))
    seen = scanned.first_seen >= first
    colors[seen] = steps[scanned.first_seen[seen] - first]
    colors[(scanned.first_seen >= 0) & ~seen] = to_rgb(SKY)
    return np.asarray(colors)


def _middle_line(scanned: AdaptiveScanned, T_WS: FloatArray, T_TW: FloatArray) -> FloatArray:
    """Return where the middle of the laser line runs at the stand-off, `(n, 3)` in the table's frame."""
    stand_off_mm = scanned.scanned.scan.cell.probe.stand_off_mm
    dense = np.linspace(0.0, 1.0, 12)[:, np.newaxis]
    ends = T_WS[:, :3, 3] + stand_off_mm * T_WS[:, :3, 2]
    line = np.concatenate([a + dense * (b - a) for a, b in pairwise(ends)])
    return np.asarray(line @ T_TW[:3, :3].T + T_TW[:3, 3])


def _draw_line(axes: Axes, view: View, depths_mm: FloatArray, line: FloatArray, number: int) -> None:
    row, column, depth_mm = view.pixels(line)
    inside = (row >= 0) & (row < depths_mm.shape[0]) & (column >= 0) & (column < depths_mm.shape[1])
    surface_mm = np.full(len(line), np.inf)
    surface_mm[inside] = np.nan_to_num(depths_mm[row[inside], column[inside]], nan=np.inf)
    in_front = depth_mm <= surface_mm + _ON_SURFACE_MM
    shown = float(np.mean(in_front))
    alpha = 0.9 if shown > 0.5 else _BEHIND
    axes.plot(column, row, color=INK, linewidth=1.0, alpha=alpha)
    axes.plot(column[:1], row[:1], color=INK, marker="o", markersize=2.5, alpha=alpha)
    if shown > 0.5:
        axes.text(column[-1], row[-1], str(number), fontsize=7.5, color=INK)


@styled()
def coverage_steps_figure(scanned: AdaptiveScanned) -> Figure:
    """Return the share of what can be seen after each strip; of the whole surface where that is not known."""
    figure = new_figure(3.0)
    axes = figure.subplots()
    shares = np.array(scanned.seen_after) / max(1, int(scanned.visible.sum()))
    first = int(scanned.path is None)
    numbers = np.arange(first, first + len(shares))
    axes.bar(numbers, shares, color=[SKY if scanned.path is not None and n == 0 else BLUE for n in numbers], width=0.7)
    wanted = scanned.adapt.share
    if wanted > 0.0 and scanned.knows_visible:
        axes.axhline(wanted, **LIMIT)
        axes.annotate(f"wanted {wanted:.1%}", (numbers[0] - 0.4, wanted), va="bottom", color=GREEN)
    axes.set_ylim(0.0, 1.08)
    axes.yaxis.set_major_formatter(PercentFormatter(1.0))
    axes.set_xlim(numbers[0] - 0.8, numbers[-1] + 0.8)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))
    axes.set_xlabel("strip" if scanned.path is None else "strip (0: the predefined path)")
    axes.set_ylabel("seen of what can be seen" if scanned.knows_visible else "seen of the whole surface")
    return figure
