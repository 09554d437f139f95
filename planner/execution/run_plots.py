"""Pictures of a run: the path on the map, the motion, and how far it was from the plan."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from planner.arrays import FloatArray
from planner.execution.run_file import StoredRun
from planner.execution.run_verification import RunVerification
from planner.execution.table_motion import Phase
from planner.map.map_colours import coloured
from protocol.whole_file import whole_file

PLANNED, EXECUTED, REFERENCE, TRUE, PAUSE = "#d55e00", "#0072b2", "#7a7f87", "#009e73", "#e7a33e"
"""Colours that remain apart for colour-blind readers."""

_SETTINGS: dict[Any, Any] = {
    "svg.hashsalt": "seventh-axis",  # the same figure gives the same bytes
    "svg.fonttype": "none",
    "font.family": "sans-serif",
    "font.size": 9.5,
    "axes.edgecolor": "#9aa0a8",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "grid.color": "#e3e6ea",
    "legend.frameon": False,
}
_DPI = 120
_SAMPLES = 1500
_WIDTH_IN = 9.6


@contextmanager
def figure_style() -> Iterator[None]:
    """Draw and save in the style of the run's pictures."""
    with mpl.rc_context(_SETTINGS):
        yield


def map_figure(run: StoredRun, checked: RunVerification) -> Figure:
    """Return the configuration map with the planned and the executed path."""
    figure = Figure(figsize=(_WIDTH_IN, 4.6), layout="constrained")
    draw_map(figure.subplots(), run, checked)
    return figure


def motion_figure(run: StoredRun) -> Figure:
    """Return angle and speed in time, planned and seen."""
    figure = Figure(figsize=(_WIDTH_IN, 4.4), layout="constrained")
    angle, speed = figure.subplots(2, 1, sharex=True)
    draw_angle(angle, run)
    draw_speed(speed, run)
    speed.set_xlabel("time (s)")
    return figure


def deviation_figure(run: StoredRun, checked: RunVerification) -> Figure:
    """Return how far each angle was from the plan."""
    figure = Figure(figsize=(_WIDTH_IN, 3.2), layout="constrained")
    draw_deviation(figure.subplots(), run, checked)
    return figure


def plot_run(run: StoredRun, checked: RunVerification, file: Path) -> None:
    """Write all pictures of a run into one file, which appears when it is whole."""
    with figure_style():
        figure = Figure(figsize=(_WIDTH_IN, 11.6), dpi=_DPI, layout="constrained")
        on_map, angle, speed, deviation = figure.subplots(4, 1, height_ratios=(2.4, 1.2, 1.2, 1.4))
        draw_map(on_map, run, checked)
        draw_angle(angle, run)
        draw_speed(speed, run)
        draw_deviation(deviation, run, checked)
        good = checked.is_verified
        figure.suptitle(f"{run.run_input.name}   {checked.verdict}", color="#2e7d4f" if good else "#b3362b", wrap=True)
        with whole_file(file) as partial:
            figure.savefig(partial, format="png", metadata={"Software": None})


def draw_map(axes: Axes, run: StoredRun, checked: RunVerification) -> None:
    """Draw the map, grey where allowed, with both paths and the touched cells."""
    configuration_map = run.run_input.problem.map
    image, reasons = coloured(configuration_map)
    half_deg = 0.5 * configuration_map.angle_step_deg
    extent = (-0.5, configuration_map.location_count - 0.5, -half_deg, 360.0 - half_deg)
    axes.imshow(image, origin="lower", aspect="auto", interpolation="nearest", extent=extent)
    _draw_wrapped(axes, run.run_input.plan.angles_deg, PLANNED, 4.5, "planned")
    _draw_wrapped(axes, checked.located_deg, "black", 1.1, "executed (encoder)")
    for step in checked.forbidden_steps:
        axes.axvspan(step, step + 1, color="#ff0000", alpha=0.4, linewidth=0.0)
    for pause in run.run_input.plan.pauses:
        axes.axvline(pause.step + 0.5, color=PAUSE, linewidth=1.0)
    axes.set(xlabel="scan location", ylabel="table angle (deg)", yticks=range(0, 361, 60), ylim=(0.0, 359.9))
    patches = [Patch(facecolor=entry.colour, label=entry.text) for entry in reasons]
    axes.legend(
        handles=[*axes.get_legend_handles_labels()[0], *patches],
        loc="upper left",
        bbox_to_anchor=(1.01, 1.0),
        fontsize=8.5,
    )


def draw_angle(axes: Axes, run: StoredRun) -> None:
    """Draw the angle in time."""
    times = np.linspace(run.motion.start_s, run.motion.end_s, _SAMPLES)
    axes.plot(times, run.motion.angles_at(times), color=PLANNED, linewidth=3.0, alpha=0.5, label="planned")
    seen = [(each.time_s, each.encoder_deg) for each in run.record.observations if each.source == "H"]
    if seen:
        axes.plot(*zip(*seen, strict=True), ".", color=EXECUTED, markersize=2.5, label="read (H)")
    axes.set_ylabel("angle (deg)")
    axes.legend(loc="best", ncols=2)
    _finish(axes, run)


def draw_speed(axes: Axes, run: StoredRun) -> None:
    """Draw the planned speed and the S of each command."""
    times = np.linspace(run.motion.start_s, run.motion.end_s, _SAMPLES)
    speeds = [run.motion.state_at(float(time)).speed_deg_s for time in times]
    axes.plot(times, speeds, color=PLANNED, linewidth=3.0, alpha=0.5, label="planned")
    seen = [each for each in run.record.observations if each.source == "inside" and each.column is None]
    if len(seen) > 2:
        seen_s = np.array([each.time_s for each in seen])
        encoder_deg = np.array([each.encoder_deg for each in seen])
        axes.plot(0.5 * (seen_s[1:] + seen_s[:-1]), np.diff(encoder_deg) / np.diff(seen_s), color=EXECUTED,
                  linewidth=0.7, label="encoder, by differences")  # fmt: skip
    axes.set_ylabel("speed (deg/s)")
    axes.legend(loc="best", ncols=2)
    _finish(axes, run)


def draw_deviation(axes: Axes, run: StoredRun, checked: RunVerification) -> None:
    """Draw seen minus planned, between the tolerances."""
    seen = [each for each in run.record.observations if each.source == "inside" and each.time_s >= 0.0]
    times = np.array([each.time_s for each in seen])
    planned, ahead = run.motion.angles_at(times), run.motion.angles_at(times + run.conditions.lead_s)
    lines = (
        ("true angle", TRUE, planned, [each.true_deg for each in seen]),
        ("encoder", EXECUTED, planned, [each.encoder_deg for each in seen]),
        ("reference, as commanded", REFERENCE, ahead, [each.reference_deg for each in seen]),
    )
    for label, colour, plan, angles in lines:
        if seen and None not in angles:
            axes.plot(times, np.array(angles, dtype=float) - plan, color=colour, linewidth=0.8, label=label)
    for source, marker in (("L", "o"), ("H", ".")):
        read = [each for each in run.record.observations if each.source == source and each.time_s >= 0.0]
        if source == "L":
            read = [each for each in read if each.column not in checked.missing_triggers]
        if read and (source == "L" or not seen):
            read_s = np.array([each.time_s for each in read])
            errors = np.array([each.encoder_deg for each in read]) - run.motion.angles_at(read_s)
            name = "latched (L)" if source == "L" else "read (H)"
            axes.plot(read_s, errors, marker, color="#23272d", markersize=2.5, linestyle="none", label=name)
    for sign in (-1.0, 1.0):
        axes.axhline(sign * checked.tolerance_deg, color="#b3362b", linestyle="--", linewidth=0.8)
    axes.set(ylabel="seen - planned (deg)", xlabel="time (s)")
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, 1.22), ncols=4)
    _finish(axes, run)


def _finish(axes: Axes, run: StoredRun) -> None:
    axes.grid(visible=True)
    axes.set_xlim(run.motion.start_s, run.motion.end_s)
    for leg in run.motion.legs:
        if leg.phase is Phase.ROTATE:
            axes.axvspan(leg.start_s, leg.end_s, color=PAUSE, alpha=0.25, linewidth=0.0)


def _draw_wrapped(axes: Axes, angles_deg: FloatArray, colour: str, width: float, label: str) -> None:
    """Draw a path wrapped to one turn, each turn it is in as a line of its own; outside the axes nothing shows."""
    columns = np.arange(len(angles_deg))
    known = angles_deg[np.isfinite(angles_deg)]
    if not len(known):
        return
    for turn in range(int(np.floor(known.min() / 360.0)), int(np.floor(known.max() / 360.0)) + 1):
        axes.plot(columns, angles_deg - 360.0 * turn, color=colour, linewidth=width, label=label)
        label = "_"
