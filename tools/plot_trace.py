"""Draw a trace of the emulator: `python -m tools.plot_trace TRACE --out FILE.png`.

From top to bottom: reference and measured speed with the commands that made them, position, and what the motor did.
"""

import protocol.quiet_start  # noqa: F401 - before the imports that take long

# isort: split
import argparse
import sys
from math import inf
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from emulator.trace import Trace, read_trace
from planner.plot_style import BLUE, GREEN, PALE, SKY, VERMILION, new_figure, save_picture, styled
from protocol.command_line import Parser, program_name
from protocol.data_file import did_you_mean
from protocol.ending import ended
from tools.command_marks import commands_of, mark_commands
from tools.envelope import envelope

_EXAMPLE = """examples:
  python -m emulator --pty --trace run.csv
  python -m tools.plot_trace run.csv --out run.png
  python -m tools.plot_trace run.csv --out detail.png --from 12 --to 14.5 --signals speed_deg_s,duty

Of commands close together the first ones are labeled, with the number of the others.
"""

_HEIGHT_IN = 7.5
_THIN, _WIDE = 0.9, 4.0
_LEGEND_SHARE = 0.25
"""Room above the curves for a legend, as a share of their range."""


class Signal(NamedTuple):
    """How a column of the trace is drawn."""

    label: str
    color: str
    linewidth: float = _THIN
    factor: float = 1.0


class Panel(NamedTuple):
    """Axes with the signals that may stand in them, by column, in the order in which they are drawn."""

    ylabel: str
    height: float
    signals: dict[str, Signal]


_PANELS = (
    Panel(
        "speed (deg/s)",
        3.0,
        {
            "reference_speed_deg_s": Signal("reference", PALE, _WIDE),
            "true_speed_deg_s": Signal("true", SKY),
            "speed_deg_s": Signal("measured", BLUE),
        },
    ),
    Panel(
        "position (deg)",
        2.0,
        {
            "reference_deg": Signal("reference", PALE, _WIDE),
            "true_deg": Signal("true", SKY),
            "encoder_deg": Signal("encoder", BLUE),
        },
    ),
    Panel("duty (%)", 2.0, {"duty": Signal("duty", GREEN, factor=100.0)}),
    Panel("current (mA)", 2.0, {"current_A": Signal("current", VERMILION, factor=1000.0)}),
)
SIGNALS = tuple(name for panel in _PANELS for name in panel.signals)
_DEFAULT_SIGNALS = tuple(name for name in SIGNALS if name != "true_deg")


@styled()
def draw_trace(
    trace: Trace,
    title: str = "",
    from_s: float | None = None,
    to_s: float | None = None,
    signals: tuple[str, ...] = _DEFAULT_SIGNALS,
) -> Figure:
    """Return the figure of a trace.

    Args:
        trace: A run of at least one tick.
        title: Stands above the figure.
        from_s: Start of what is drawn; the trace's start by default.
        to_s: End of what is drawn; the trace's end by default.
        signals: Columns of the trace, of `SIGNALS`.

    Raises:
        ValueError: The trace is empty, no part of it lies between the times, or a signal is not known.
    """
    if not len(trace.time_s):
        raise ValueError(f"{title}: the trace holds no tick; record it until something has happened")
    _check_signals(signals)
    rows, (begin_s, end_s) = _selection(trace, from_s, to_s)
    panels = [panel for panel in _PANELS if not panel.signals.keys().isdisjoint(signals)]
    figure = new_figure(_HEIGHT_IN)
    axes = figure.subplots(
        len(panels), 1, sharex=True, squeeze=False, height_ratios=[panel.height for panel in panels]
    )[:, 0].tolist()
    figure.suptitle(title)
    for each, panel in zip(axes, panels, strict=True):
        _draw_panel(each, panel, trace, rows, signals)
    axes[-1].set_xlabel("time (s)")
    if end_s > begin_s:
        axes[0].set_xlim(begin_s, end_s)
    mark_commands(axes, commands_of(trace))
    return figure


def _check_signals(signals: tuple[str, ...]) -> None:
    for name in signals:
        if name not in SIGNALS:
            raise ValueError(f"{name!r} is not a signal; allowed are {', '.join(SIGNALS)}{did_you_mean(name, SIGNALS)}")
    if not signals:
        raise ValueError(f"no signal to draw; allowed are {', '.join(SIGNALS)}")


def _selection(trace: Trace, from_s: float | None, to_s: float | None) -> tuple[slice, tuple[float, float]]:
    """Return the rows to draw, with a neighbor at each end as nothing changes in between, and the time's limits."""
    first_s, last_s = float(trace.time_s[0]), float(trace.time_s[-1])
    begin_s, end_s = first_s if from_s is None else from_s, last_s if to_s is None else to_s
    for name, value in (("--from", begin_s), ("--to", end_s)):
        if not -inf < value < inf:
            raise ValueError(f"{name} is {value:g}; it must be a time in seconds")
    if from_s is not None and to_s is not None and not begin_s < end_s:
        raise ValueError(f"--from is {begin_s:g}, --to is {end_s:g}; --from must be less than --to")
    limits_s = max(begin_s, first_s), min(end_s, last_s)
    if limits_s[0] >= limits_s[1] and (from_s, to_s) != (None, None):
        raise ValueError(
            f"no part of the trace lies within {begin_s:g} to {end_s:g} s; it runs from {first_s:g} to {last_s:g} s"
        )
    first = int(np.searchsorted(trace.time_s, begin_s, side="right")) - 1
    last = int(np.searchsorted(trace.time_s, end_s))
    return slice(max(first, 0), last + 1), limits_s


def _draw_panel(axes: Axes, panel: Panel, trace: Trace, rows: slice, signals: tuple[str, ...]) -> None:
    chosen = {name: signal for name, signal in panel.signals.items() if name in signals}
    for name, signal in chosen.items():
        times_s, values = envelope(trace.time_s[rows], signal.factor * getattr(trace, name)[rows])
        axes.plot(times_s, values, color=signal.color, linewidth=signal.linewidth, label=signal.label)
    axes.set_ylabel(panel.ylabel)
    axes.margins(x=0.0)
    if len(chosen) > 1:
        low, high = axes.get_ylim()
        axes.set_ylim(low, high + _LEGEND_SHARE * (high - low))
        axes.legend(loc="upper right", ncols=len(chosen))


def main(arguments: list[str] | None = None) -> int:
    """Run the command line and return its exit status."""
    options = parser().parse_args(arguments)
    return ended("plot_trace", lambda: _draw(options), ValueError)


def parser() -> Parser:
    """Return the parser of the command line."""
    parser = Parser(
        prog=program_name("tools.plot_trace"),
        description="Draw a trace that the emulator recorded.",
        epilog=_EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("trace", metavar="TRACE", type=Path, help="a .csv or .npz file of python -m emulator --trace")
    parser.add_argument("--out", metavar="FILE", type=Path, required=True, help="the picture: .png, .svg or .pdf")
    parser.add_argument(
        "--from", dest="from_s", metavar="S", type=float, help="start time in s (default: of the trace)"
    )
    parser.add_argument("--to", dest="to_s", metavar="S", type=float, help="end time in s (default: of the trace)")
    parser.add_argument(
        "--signals",
        metavar="NAME,...",
        default=",".join(_DEFAULT_SIGNALS),
        help=f"columns to draw, of {', '.join(SIGNALS)} (default: all but true_deg)",
    )
    return parser


def _draw(options: argparse.Namespace) -> int:
    signals = tuple(name.strip() for name in options.signals.split(",") if name.strip())
    _check_signals(signals)
    figure = draw_trace(read_trace(options.trace), options.trace.name, options.from_s, options.to_s, signals)
    save_picture(figure, options.out)
    return 0


if __name__ == "__main__":
    sys.exit(main())
