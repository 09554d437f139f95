"""A trace of the emulator as a figure.

From top to bottom: reference and measured speed with their commands, position, and the state of the motor.
"""

from math import inf
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from emulator.trace import Trace
from planner.plot_style import BLUE, GREEN, PALE, SKY, VERMILION, new_figure, styled
from tools.command_marks import commands_of, mark_commands
from tools.envelope import envelope
from tools.trace_signals import DEFAULT_SIGNALS, check_signals

_HEIGHT_IN = 7.5
_THIN, _WIDE = 0.9, 4.0
_LEGEND_SHARE = 0.25
"""Space above the curves for a legend, as a share of their range."""


class Signal(NamedTuple):
    """The style of a column of the trace."""

    label: str
    color: str
    linewidth: float = _THIN
    factor: float = 1.0


class Panel(NamedTuple):
    """Axes with their possible signals, by column, in drawing order."""

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


@styled()
def draw_trace(
    trace: Trace,
    title: str = "",
    from_s: float | None = None,
    to_s: float | None = None,
    signals: tuple[str, ...] = DEFAULT_SIGNALS,
) -> Figure:
    """Return the figure of a trace.

    Args:
        trace: a run of at least one tick.
        title: title of the figure.
        from_s: start of the drawn part; default: the trace's start.
        to_s: end of the drawn part; default: the trace's end.
        signals: columns of the trace, from `SIGNALS`.

    Raises:
        ValueError: the trace is empty, none of it is between the times, or a signal is unknown.
    """
    if not len(trace.time_s):
        raise ValueError(f"{title}: the trace contains no tick; record a longer one")
    check_signals(signals)
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


def _selection(trace: Trace, from_s: float | None, to_s: float | None) -> tuple[slice, tuple[float, float]]:
    """Return the rows to draw, with a neighbor at each end, and the limits of the time."""
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
            f"no part of the trace is within {begin_s:g} to {end_s:g} s; it runs from {first_s:g} to {last_s:g} s"
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
