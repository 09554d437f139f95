"""Plots of a scan: the coverage of the part, and the sources of the error."""

import matplotlib as mpl
import numpy as np
import trimesh
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from planner.geometry.ray_casting import RayCaster
from planner.plot_style import AMBER, BLUE, GRAY, GREEN, INK, PALE, VERMILION, new_figure, styled
from planner.scanning.coverage import Coverage
from planner.scanning.error_budget import ErrorBudget
from planner.scanning.part_view import VIEWS, View, painted
from planner.scanning.probe import Sight

_STATE_COLORS = {
    Sight.SEEN: GREEN,
    Sight.NEVER_IN_VIEW: GRAY,
    Sight.OUT_OF_RANGE: BLUE,
    Sight.INCIDENCE: AMBER,
    Sight.OCCLUDED: VERMILION,
}
STATE_NAMES = {
    Sight.SEEN: "seen",
    Sight.NEVER_IN_VIEW: "never in view",
    Sight.OUT_OF_RANGE: "out of reach",
    Sight.INCIDENCE: "incidence",
    Sight.OCCLUDED: "occluded",
}


@styled()
def coverage_figure(mesh: trimesh.Trimesh, coverage: Coverage) -> Figure:
    """Return the part with its sample points, colored by their state."""
    caster = RayCaster(mesh)
    colors = np.array([to_rgb(_STATE_COLORS[Sight(code)]) for code in coverage.codes])
    shares = coverage.shares()
    figure = new_figure(4.1)
    for axes, (azimuth, elevation) in zip(figure.subplots(1, len(VIEWS)), VIEWS, strict=True):
        image = painted(View.of(mesh, azimuth, elevation), caster, coverage.points, colors, 5)
        axes.imshow(image, interpolation="antialiased")
        axes.set_axis_off()
    handles = [
        mpl.patches.Patch(color=_STATE_COLORS[code], label=f"{STATE_NAMES[code]} {shares[code]:.1%}")
        for code in _STATE_COLORS
        if shares[code] > 0.0
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
    return figure


@styled()
def budget_figure(budget: ErrorBudget) -> Figure:
    """Return the displacement of the points by each source alone, and the distribution of the distances."""
    figure = new_figure(3.3)
    bars, spread = figure.subplots(1, 2, width_ratios=(1.15, 1.0))
    names = [*budget.parts, "all together"]
    shares = [*((part.displacement_mm, part.across_mm) for part in budget.parts.values()), budget.total]
    place = np.arange(len(names))[::-1]
    bars.barh(place + 0.19, [1e3 * moved for moved, _ in shares], 0.36, color=BLUE, label="displacement")
    bars.barh(
        place - 0.19,
        [1e3 * across for _, across in shares],
        0.36,
        color=AMBER,
        label="of it perpendicular to the surface",
    )
    bars.set_yticks(place, names)
    bars.set_xlabel("root mean square (µm)")
    bars.legend(loc="best")
    errors_um = 1e3 * budget.errors_mm
    mean, sigma = 1e3 * budget.distances.mean, 1e3 * budget.distances.sigma
    span = max(4.0 * sigma, 1e-3)
    grid = np.linspace(mean - span, mean + span, 81)
    spread.hist(errors_um, bins=grid, density=True, color=PALE)
    normal = np.exp(-0.5 * ((grid - mean) / max(sigma, 1e-9)) ** 2) / (max(sigma, 1e-9) * np.sqrt(2.0 * np.pi))
    spread.plot(grid, normal, color=INK, linewidth=1.0, label=f"normal, sigma {sigma:.1f} µm")
    spread.set_xlabel("distance from the surface (µm)")
    spread.set_yticks([])
    spread.legend(loc="upper right")
    return figure
