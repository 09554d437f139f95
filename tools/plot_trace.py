"""Draw a trace of the stand-in: `python -m tools.plot_trace TRACE --out FILE.png`.

From top to bottom: reference and measured speed with the commands that made them, position, and what the motor did.
"""

import argparse
import sys
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from emulator.trace import Trace, read_trace
from planner.whole_file import whole_file
from protocol import LineBuffer
from tools.command_line import ended

_EXAMPLE = """example:
  python -m emulator --pty --trace run.csv
  python -m tools.plot_trace run.csv --out run.png
"""

_REFERENCE, _MEASURED, _TRUE, _DUTY, _CURRENT = "#c8c8c8", "#0072b2", "#56b4e9", "#009e73", "#d55e00"
"""Colours that remain apart for colour-blind readers (Okabe and Ito)."""

_MOTION_VERBS = "PRSA"
_LABEL_POINTS = 8.0
_LABEL_SHARE = 0.03
"""Commands closer together than this share of the run stand under one another, at the first one's time."""
_FIGURE_INCHES = (10.0, 7.5)


def commands_of(trace: Trace) -> list[tuple[float, str]]:
    """Return the lines that change the motion, each with the time in seconds at which its CR was received."""
    lines = LineBuffer()
    return [
        (float(time_s), text)
        for time_s, data in zip(trace.time_s, trace.received, strict=True)
        for line in lines.feed(data)
        if isinstance(line, bytes) and (text := line.decode("ascii").strip())[0] in _MOTION_VERBS
    ]


def draw_trace(trace: Trace, title: str = "") -> Figure:
    """Return the figure of a trace.

    Args:
        trace: a run of at least one tick.
        title: stands above the figure.

    Raises:
        ValueError: the trace is empty.
    """
    if not len(trace.time_s):
        raise ValueError(f"{title}: the trace holds no tick; record it until something has happened")
    figure = Figure(figsize=_FIGURE_INCHES, layout="constrained")
    FigureCanvasAgg(figure)
    speed, position, motor = figure.subplots(3, 1, sharex=True, height_ratios=(3, 2, 2))
    figure.suptitle(title)

    speed.plot(trace.time_s, trace.reference_speed_deg_s, color=_REFERENCE, linewidth=4.0, label="reference")
    speed.plot(trace.time_s, trace.true_speed_deg_s, color=_TRUE, linewidth=0.9, label="true")
    speed.plot(trace.time_s, trace.speed_deg_s, color=_MEASURED, linewidth=0.9, label="measured")
    speed.set_ylabel("speed (deg/s)")

    position.plot(trace.time_s, trace.reference_deg, color=_REFERENCE, linewidth=4.0, label="reference")
    position.plot(trace.time_s, trace.encoder_deg, color=_MEASURED, linewidth=0.9, label="encoder")
    position.set_ylabel("position (deg)")

    motor.plot(trace.time_s, 100.0 * trace.duty, color=_DUTY, linewidth=0.9, label="duty")
    motor.set_ylabel("duty (%)", color=_DUTY)
    motor.set_xlabel("time (s)")
    current = motor.twinx()
    current.plot(trace.time_s, 1000.0 * trace.current_A, color=_CURRENT, linewidth=0.9, label="current")
    current.set_ylabel("current (mA)", color=_CURRENT)
    motor.set_zorder(current.get_zorder() + 1.0)  # the current is the noisier: it must not hide the duty
    motor.patch.set_visible(False)

    for axes in (motor, current):  # both zeros at the same height
        farthest = max(map(abs, axes.get_ylim()))
        axes.set_ylim(-farthest, farthest)
    for axes in (speed, position, motor):
        axes.grid(alpha=0.25)
        axes.spines[["top", "right"]].set_visible(False)
        axes.margins(x=0.0)
    current.spines["top"].set_visible(False)
    speed.legend(loc="upper right", edgecolor="none", ncols=3)
    position.legend(loc="upper left", edgecolor="none", ncols=2)
    _mark_commands(speed, (position, motor), commands_of(trace))
    return figure


def main(arguments: list[str] | None = None) -> int:
    """Run the command line and return its exit status."""
    parser = argparse.ArgumentParser(
        prog="python -m tools.plot_trace",
        description="Draw a trace that the stand-in recorded.",
        epilog=_EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("trace", metavar="TRACE", type=Path, help="a .csv or .npz file of python -m emulator --trace")
    parser.add_argument("--out", metavar="FILE", type=Path, required=True, help="the picture: .png, .svg or .pdf")
    options = parser.parse_args(arguments)
    return ended("plot_trace", lambda: _draw(options), ValueError)


def _draw(options: argparse.Namespace) -> int:
    save_figure(draw_trace(read_trace(options.trace), options.trace.name), options.out)
    return 0


def _mark_commands(labelled: Axes, others: tuple[Axes, ...], commands: list[tuple[float, str]]) -> None:
    """Draw a line through all axes at each group of commands, with their text above the first axes."""
    begin_s, end_s = labelled.get_xlim()
    groups: list[tuple[float, list[str]]] = []
    for time_s, text in commands:
        if groups and time_s - groups[-1][0] < _LABEL_SHARE * (end_s - begin_s):
            groups[-1][1].append(text)
        else:
            groups.append((time_s, [text]))
    for time_s, texts in groups:
        for axes in (labelled, *others):
            axes.axvline(time_s, color="black", linewidth=0.6, alpha=0.5, zorder=0.5)
        labelled.annotate(
            "\n".join(texts),
            (time_s, 1.0),
            xycoords=("data", "axes fraction"),
            xytext=(0, 3),
            textcoords="offset points",
            fontsize=_LABEL_POINTS,
            va="bottom",
            ha="center",
        )


def save_figure(figure: Figure, path: Path) -> None:
    """Write the picture under a temporary name first, so that no half of it is ever at `path`."""
    with whole_file(path) as partial:
        figure.savefig(partial, dpi=150)


if __name__ == "__main__":
    sys.exit(main())
