"""The plot of a plan: the map with the path, the speed and the acceleration (Fig. 7 and 9)."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import Normal, Stroke

from planner.arrays import FloatArray
from planner.map.map_colors import colored
from planner.map.map_plots import draw_grays, draw_legend, draw_map, legend_height_in
from planner.plans.plan import Pause, Plan
from planner.plans.problem import Problem
from planner.plot_style import BLUE, LIMIT, SKY, VERMILION, new_figure, save_picture, styled

PATH: dict[str, Any] = {
    "color": VERMILION,
    "linewidth": 2.6,
    "path_effects": [Stroke(linewidth=4.6, foreground="white"), Normal()],
}
"""A plan on its map, with a white edge: the map may have similar colors."""


@styled()
def plan_figure(problem: Problem, plan: Plan, title: str) -> Figure:
    """Return a plan on its map, with its speed, its acceleration, the limits and the pauses."""
    legend = colored(problem.map)[1]
    figure = new_figure(8.6 + legend_height_in(legend))
    on_map, speed, acceleration = figure.subplots(3, 1, sharex=True, height_ratios=(2.2, 1.0, 1.0))
    draw_map(on_map, problem.map)
    draw_path(on_map, plan.angles_deg, **PATH)
    on_map.set_title(title)
    draw_grays(figure, on_map)
    draw_legend(figure, legend)
    draw_motion(speed, acceleration, problem, plan)
    return figure


def plot_plan(problem: Problem, plan: Plan, title: str, file: Path) -> None:
    """Write the plot of a plan to `file`, which appears when it is complete."""
    save_picture(plan_figure(problem, plan, title), file)


def draw_path(axes: Axes, angles_deg: FloatArray, label: str = "_", **line: Any) -> None:  # noqa: ANN401  # matplotlib's
    """Draw a path `(n,)` over the map, wrapped to one turn: each turn has its own line.

    Parts outside of the axes are not visible; NaN interrupts the path.
    """
    columns = np.arange(len(angles_deg))
    known = angles_deg[np.isfinite(angles_deg)]
    if not len(known):
        return
    for turn in range(int(np.floor(known.min() / 360.0)), int(np.floor(known.max() / 360.0)) + 1):
        axes.plot(columns, angles_deg - 360.0 * turn, **line, label=label)
        label = "_"
    axes.set_ylim(0.0, 359.9)


def draw_motion(speed: Axes, acceleration: Axes, problem: Problem, plan: Plan) -> None:
    """Draw speed and acceleration between their limits, and mark the pauses."""
    locations = np.arange(len(plan.angles_deg))
    speed.plot(locations, plan.speeds_deg_s, color=BLUE)
    speed.set_ylabel("speed (deg/s)")
    acceleration.stairs(plan.accelerations_deg_s2, locations, color=BLUE, baseline=None)
    acceleration.set(ylabel="acceleration (deg/s2)", xlabel="scan location")
    for axes, limit in ((speed, problem.limits.speed_deg_s), (acceleration, problem.limits.acceleration_deg_s2)):
        axes.set_ylim(-1.1 * limit, 1.1 * limit)
        for bound in (-limit, limit):
            axes.axhline(bound, **LIMIT)
        mark_pauses(axes, plan.pauses)
    if plan.pauses:
        speed.legend(loc="upper right")


def mark_pauses(axes: Axes, pauses: tuple[Pause, ...]) -> None:
    """Mark the steps in which the table turns while the arm is retracted."""
    for number, pause in enumerate(pauses):
        axes.axvline(pause.step + 0.5, color=SKY, linewidth=1.0, label="_" if number else "pause")
