"""Plots of a run: the path on the map, the motion, and the deviation from the plan."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from planner.execution.run_file import StoredRun
from planner.execution.run_verification import RunVerification
from planner.execution.table_motion import Phase
from planner.map.map_colors import colored
from planner.map.map_plots import draw_map
from planner.plans.plan_plots import draw_path, mark_pauses
from planner.plot_style import (
    BLUE,
    EXECUTED,
    GRAY,
    GREEN,
    INK,
    LIMIT,
    PLANNED,
    SKY,
    VERMILION,
    new_figure,
    save_picture,
    styled,
)

_SAMPLES = 1500


@styled()
def map_figure(run: StoredRun, checked: RunVerification) -> Figure:
    """Return the configuration map with the planned and the executed path."""
    figure = new_figure(4.6)
    draw_paths(figure.subplots(), run, checked)
    return figure


@styled()
def motion_figure(run: StoredRun) -> Figure:
    """Return angle and speed over time, planned and measured."""
    figure = new_figure(4.4)
    angle, speed = figure.subplots(2, 1, sharex=True)
    draw_angle(angle, run)
    draw_speed(speed, run)
    speed.set_xlabel("time (s)")
    return figure


@styled()
def deviation_figure(run: StoredRun, checked: RunVerification) -> Figure:
    """Return the deviation of each angle from the plan."""
    figure = new_figure(3.2)
    draw_deviation(figure.subplots(), run, checked)
    return figure


@styled()
def plot_run(run: StoredRun, checked: RunVerification, file: Path) -> None:
    """Write all plots of a run to one file, which appears when it is complete."""
    figure = new_figure(11.6)
    on_map, angle, speed, deviation = figure.subplots(4, 1, height_ratios=(2.4, 1.2, 1.2, 1.4))
    draw_paths(on_map, run, checked)
    draw_angle(angle, run)
    draw_speed(speed, run)
    draw_deviation(deviation, run, checked)
    color = GREEN if checked.is_verified else VERMILION
    figure.suptitle(f"{run.run_input.name}   {checked.verdict}", color=color, wrap=True)
    save_picture(figure, file)


def draw_paths(axes: Axes, run: StoredRun, checked: RunVerification) -> None:
    """Draw the map with both paths, and the steps in which a forbidden cell was touched."""
    draw_map(axes, run.run_input.problem.map)
    draw_path(axes, run.run_input.plan.angles_deg, "planned", **PLANNED)
    draw_path(axes, checked.located_deg, "executed (encoder)", **EXECUTED)
    for step in checked.forbidden_steps:
        axes.axvspan(step, step + 1, color=VERMILION, alpha=0.4, linewidth=0.0)
    mark_pauses(axes, run.run_input.plan.pauses)
    axes.set_xlabel("scan location")
    patches = [Patch(facecolor=entry.color, label=entry.text) for entry in colored(run.run_input.problem.map)[1]]
    axes.legend(
        handles=[*axes.get_legend_handles_labels()[0], *patches],
        loc="upper left",
        bbox_to_anchor=(1.01, 1.0),
        fontsize=8.5,
    )


def draw_angle(axes: Axes, run: StoredRun) -> None:
    """Draw the angle over time."""
    times = np.linspace(run.motion.start_s, run.motion.end_s, _SAMPLES)
    axes.plot(times, run.motion.angles_at(times), **PLANNED, label="planned")
    seen = [(each.time_s, each.encoder_deg) for each in run.record.observations if each.source == "H"]
    if seen:
        axes.plot(*zip(*seen, strict=True), **EXECUTED, label="read (H)")
    axes.set_ylabel("angle (deg)")
    axes.legend(loc="best", ncols=2)
    _finish(axes, run)


def draw_speed(axes: Axes, run: StoredRun) -> None:
    """Draw the planned speed and the S of each command."""
    times = np.linspace(run.motion.start_s, run.motion.end_s, _SAMPLES)
    speeds = [run.motion.state_at(float(time)).speed_deg_s for time in times]
    axes.plot(times, speeds, **PLANNED, label="planned")
    seen = [each for each in run.record.observations if each.source == "inside" and each.column is None]
    if len(seen) > 2:
        seen_s = np.array([each.time_s for each in seen])
        encoder_deg = np.array([each.encoder_deg for each in seen])
        axes.plot(0.5 * (seen_s[1:] + seen_s[:-1]), np.diff(encoder_deg) / np.diff(seen_s), **EXECUTED,
                  label="encoder, by differences")  # fmt: skip
    axes.set_ylabel("speed (deg/s)")
    axes.legend(loc="best", ncols=2)
    _finish(axes, run)


def draw_deviation(axes: Axes, run: StoredRun, checked: RunVerification) -> None:
    """Draw measured minus planned angles, with the tolerances."""
    seen = [each for each in run.record.observations if each.source == "inside" and each.time_s >= 0.0]
    times = np.array([each.time_s for each in seen])
    planned, ahead = run.motion.angles_at(times), run.motion.angles_at(times + run.conditions.lead_s)
    lines = (
        ("true angle", GREEN, planned, [each.true_deg for each in seen]),
        ("encoder", BLUE, planned, [each.encoder_deg for each in seen]),
        ("reference, as commanded", GRAY, ahead, [each.reference_deg for each in seen]),
    )
    for label, color, plan, angles in lines:
        if seen and None not in angles:
            axes.plot(times, np.array(angles, dtype=float) - plan, color=color, linewidth=0.8, label=label)
    for source, marker in (("L", "o"), ("H", ".")):
        read = [each for each in run.record.observations if each.source == source and each.time_s >= 0.0]
        if source == "L":
            read = [each for each in read if each.column not in checked.missing_triggers]
        if read and (source == "L" or not seen):
            read_s = np.array([each.time_s for each in read])
            errors = np.array([each.encoder_deg for each in read]) - run.motion.angles_at(read_s)
            name = "latched (L)" if source == "L" else "read (H)"
            axes.plot(read_s, errors, marker, color=INK, markersize=2.5, linestyle="none", label=name)
    for sign in (-1.0, 1.0):
        axes.axhline(sign * checked.tolerance_deg, **LIMIT)
    axes.set(ylabel="executed - planned (deg)", xlabel="time (s)")
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, 1.22), ncols=4)
    _finish(axes, run)


def _finish(axes: Axes, run: StoredRun) -> None:
    axes.set_xlim(run.motion.start_s, run.motion.end_s)
    for leg in run.motion.legs:
        if leg.phase is Phase.ROTATE:
            axes.axvspan(leg.start_s, leg.end_s, color=SKY, alpha=0.25, linewidth=0.0)
