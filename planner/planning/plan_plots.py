"""A plan's picture: the map with the path, the speed and the acceleration (Fig. 7 and 9)."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from planner.arrays import FloatArray
from planner.planning.plan import Plan
from planner.planning.problem import Problem
from protocol.whole_file import whole_file

PLAN_COLOUR, CURVE_COLOUR, PAUSE_COLOUR = "#d62728", "#1f77b4", "#e7a33e"
_DPI = 120


def plan_figure(problem: Problem, plan: Plan, title: str) -> Figure:
    """Return a plan on its map, with its speed, its acceleration, the limits and the pauses."""
    figure = Figure(figsize=(7.2, 8.4), dpi=_DPI, layout="constrained")
    on_map, speed, acceleration = figure.subplots(3, 1, sharex=True, height_ratios=(2.0, 1.0, 1.0))
    step_deg = problem.map.angle_step_deg
    extent = (-0.5, problem.map.location_count - 0.5, -0.5 * step_deg, 360.0 - 0.5 * step_deg)
    on_map.imshow(problem.map.values.T, cmap="gray", vmin=0.0, vmax=1.0, origin="lower", aspect="auto", extent=extent)
    draw_wrapped(on_map, plan.angles_deg)
    on_map.set(ylabel="table angle (deg)", yticks=range(0, 361, 60), title=title)
    draw_motion(speed, acceleration, problem, plan)
    return figure


def plot_plan(problem: Problem, plan: Plan, title: str, file: Path) -> None:
    """Write the picture of a plan to `file`, which appears when it is whole."""
    with whole_file(file) as partial:
        plan_figure(problem, plan, title).savefig(partial, format="png", metadata={"Software": None})


def draw_wrapped(axes: Axes, angles_deg: FloatArray) -> None:
    """Draw a path wrapped to one turn, interrupted where it passes 0."""
    turn = np.floor(angles_deg / 360.0)
    for value in np.unique(turn):
        beside = (turn == value) | (np.roll(turn, 1) == value) | (np.roll(turn, -1) == value)
        axes.plot(np.where(beside, angles_deg - 360.0 * value, np.nan), color=PLAN_COLOUR, linewidth=2.0)
    axes.set_ylim(0.0, 359.9)


def draw_motion(speed: Axes, acceleration: Axes, problem: Problem, plan: Plan) -> None:
    """Draw speed and acceleration between their limits, and mark the pauses."""
    locations = np.arange(len(plan.angles_deg))
    speed.plot(locations, plan.speeds_deg_s, color=CURVE_COLOUR)
    speed.set_ylabel("speed (deg/s)")
    acceleration.stairs(plan.accelerations_deg_s2, locations, color=CURVE_COLOUR, baseline=None)
    acceleration.set(ylabel="acceleration (deg/s$^2$)", xlabel="scan location")
    for axes, limit in ((speed, problem.limits.speed_deg_s), (acceleration, problem.limits.acceleration_deg_s2)):
        axes.set_ylim(-1.1 * limit, 1.1 * limit)
        for bound in (-limit, limit):
            axes.axhline(bound, color="#888888", linestyle="--", linewidth=0.8)
        axes.grid(visible=True, alpha=0.3)
        for pause in plan.pauses:
            axes.axvline(pause.step + 0.5, color=PAUSE_COLOUR, linewidth=1.0)
