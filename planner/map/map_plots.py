"""Plots of a configuration map: flat (Fig. 6a) and rolled up as a tube (Fig. 6b). The same map gives the same bytes."""

from math import ceil
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from planner.arrays import FloatArray
from planner.map.config_map import ConfigurationMap
from planner.map.map_colors import DARKEST_GRAY, LegendEntry, colored
from planner.plot_style import INK, VERMILION, new_figure, save_picture, styled

_LEGEND_COLUMNS = 3
_SAMPLES = 3
"""Samples per pixel and direction in the tube's picture."""


def plot_map(configuration_map: ConfigurationMap, file: Path) -> None:
    """Write the map as a flat picture."""
    save_picture(map_figure(configuration_map), file)


@styled()
def map_figure(configuration_map: ConfigurationMap) -> Figure:
    """Return the map as a flat picture: location to the right, table angle upward; Fig. 6a of the paper."""
    legend = colored(configuration_map)[1]
    figure = new_figure(5.0 + legend_height_in(legend))
    axes = figure.add_subplot()
    draw_map(axes, configuration_map)
    axes.set_xlabel("scan location")
    _title(figure, configuration_map)
    draw_grays(figure, axes)
    draw_legend(figure, legend)
    return figure


def draw_map(axes: Axes, configuration_map: ConfigurationMap) -> None:
    """Draw the map in its colors, with a mark above each location without an allowed table angle."""
    image, _ = colored(configuration_map)
    half_step = configuration_map.angle_step_deg / 2
    extent = (-0.5, configuration_map.location_count - 0.5, -half_step, 360.0 - half_step)
    axes.imshow(image, origin="lower", aspect="auto", extent=extent)
    axes.set(ylabel="table angle (deg)", yticks=range(0, 361, 60), ylim=extent[2:])
    axes.grid(visible=False)
    axes.xaxis.set_major_locator(MaxNLocator(10, integer=True))
    blocked = configuration_map.blocked_locations
    axes.plot(
        blocked,
        [1.012] * len(blocked),
        marker="v",
        markersize=4,
        linestyle="none",
        color=VERMILION,
        transform=axes.get_xaxis_transform(),
        clip_on=False,
        in_layout=False,
        label="_",
    )


@styled()
def plot_map_cylinder(configuration_map: ConfigurationMap, file: Path) -> None:
    """Write the map rolled up and seen from two sides; Fig. 6b of the paper.

    The table turns without a limit, so the angle axis is closed.
    """
    image, legend = colored(configuration_map)
    figure = new_figure(6.6 + legend_height_in(legend), 8.0)
    for axes, center_deg in zip(figure.subplots(2, 1), (180.0, 0.0), strict=True):
        _draw_tube(axes, image, center_deg)
    _title(figure, configuration_map)
    draw_grays(figure, figure.axes[:2])
    draw_legend(figure, legend)
    save_picture(figure, file)


_LENGTH = 4.0
"""Dimensions of the tube, in radii."""
_BULGE = 0.3
"""Distance in radii by which the near half of an end is drawn to the left, and the far half to the right."""


def _draw_tube(axes: Axes, image: FloatArray, center_deg: float) -> None:
    axes.imshow(
        _tube(image, center_deg, 700, 260),
        extent=(-_BULGE, _LENGTH + _BULGE, -1.0, 1.0),
        origin="lower",
        aspect="equal",
    )
    count = image.shape[1]
    for location in MaxNLocator(10, integer=True).tick_values(0, count - 1):
        if 0 <= location <= count - 1:
            x = _LENGTH * (location + 0.5) / count
            axes.plot([x, x], [-1.0, -1.06], color=INK, linewidth=0.8, clip_on=False)
            axes.text(x, -1.1, f"{location:.0f}", ha="center", va="top", fontsize=9, color=INK)
    for offset_deg in range(-90, 91, 45):
        y, z = np.sin(np.radians(offset_deg)), np.cos(np.radians(offset_deg))
        rim = -_BULGE * z
        axes.plot([rim - 0.06, rim], [y, y], color=INK, linewidth=0.8, clip_on=False)
        angle = f"{(center_deg + offset_deg) % 360.0:.0f}"
        axes.text(rim - 0.1, y, angle, ha="right", va="center", fontsize=9, color=INK)
    axes.text(_LENGTH / 2, -1.32, "scan location", ha="center", va="top", fontsize=10, color=INK)
    axes.text(-0.85, 0.0, "table angle (deg)", ha="center", va="center", rotation=90, fontsize=10, color=INK)
    axes.set_xlim(-0.95, _LENGTH + _BULGE)
    axes.set_ylim(-1.5, 1.05)
    axes.set_axis_off()


def _tube(image: FloatArray, center_deg: float, width: int, height: int) -> FloatArray:
    """Return an RGBA picture of an open tube with the image on its wall, and `center_deg` in front.

    A point of the wall at location s and angle phi from the front is drawn at (s - bulge cos(phi), sin(phi)). So each
    pixel shows the near half if it is there, else the inside of the far half.
    """
    x = -_BULGE + (_LENGTH + 2 * _BULGE) * (np.arange(width * _SAMPLES) + 0.5) / (width * _SAMPLES)
    y = -1.0 + 2.0 * (np.arange(height * _SAMPLES) + 0.5) / (height * _SAMPLES)
    along, across = np.meshgrid(x, y)
    depth = np.sqrt(1.0 - across**2)
    picture = np.zeros((*along.shape, 4))
    for side, shade in ((-1.0, 0.30 + 0.15 * depth), (1.0, 0.55 + 0.45 * depth)):
        s = (along + _BULGE * side * depth) / _LENGTH
        seen = (s >= 0.0) & (s < 1.0)
        angle_deg = center_deg + np.degrees(np.arctan2(across, side * depth))
        row = np.rint(angle_deg / 360.0 * image.shape[0]).astype(int) % image.shape[0]
        column = np.floor(s * image.shape[1]).astype(int)
        picture[seen, :3] = image[row[seen], column[seen]] * shade[seen, None]
        picture[seen, 3] = 1.0
    # Colors weighted by their coverage; otherwise the edge would have a dark seam.
    samples = picture.reshape(height, _SAMPLES, width, _SAMPLES, 4)
    cover = samples[..., 3].mean(axis=(1, 3))
    color = (samples[..., :3] * samples[..., 3:]).mean(axis=(1, 3)) / np.maximum(cover, 1e-9)[..., None]
    return np.dstack([np.clip(color, 0.0, 1.0), cover])


def _title(figure: Figure, configuration_map: ConfigurationMap) -> None:
    named = (configuration_map.metadata.get(key) for key in ("scan", "configuration"))
    blocked = len(configuration_map.blocked_locations)
    served = f"{configuration_map.location_count - blocked} of {configuration_map.location_count} locations reachable"
    figure.suptitle("   ".join([*(str(name) for name in named if name), served]), fontsize=11)


def draw_grays(figure: Figure, axes: Axes | list[Axes]) -> None:
    """Draw the scale of the allowed cells beside the axes."""
    grays = LinearSegmentedColormap.from_list("f_R", [(DARKEST_GRAY,) * 3, (1.0, 1.0, 1.0)])
    bar = figure.colorbar(ScalarMappable(Normalize(0.0, 1.0), grays), ax=axes, fraction=0.03, pad=0.02)
    bar.set_label("value $f_R$ where allowed")


def legend_height_in(legend: list[LegendEntry]) -> float:
    """Return the required height for `draw_legend`."""
    return 0.22 * ceil(len(legend) / _LEGEND_COLUMNS)


def draw_legend(figure: Figure, legend: list[LegendEntry]) -> None:
    """Draw the legend for the colors of the forbidden cells below the figure."""
    if legend:
        figure.legend(
            [Patch(facecolor=entry.color) for entry in legend],
            [f"{entry.text} ({_percent(entry.share)})" for entry in legend],
            loc="outside lower center",
            ncols=min(_LEGEND_COLUMNS, len(legend)),
            title="forbidden, by reason (share of the map)",
        )


def _percent(share: float) -> str:
    return f"{share:.1%}" if share >= 0.001 else "< 0.1%"
