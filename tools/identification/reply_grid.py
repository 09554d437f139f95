"""The grid of the replies: a table that replies at its ticks makes them visible to the recorder.

The phase of the replies within a tick is constant, except for the difference of the two clocks. If it is not, something
between the table and the recorder delays replies randomly. If all replies are on a coarser grid, something collects
them. In both cases the replies do not determine the ticks.
"""

from typing import NamedTuple

import numpy as np

from tools.emulated import Array

_COMMON = 0.5
"""Minimum constant share of the phase of the replies of a grid: 0..1."""
_LOCALLY_COMMON = 0.3
"""The same within a window; a window with less (late replies, or few) uses the phase of its neighbors."""

_BIN_PERIODS, _WINDOW_TICKS = 100.0, 1000.0
_LEAST_IN_WINDOW = 20
_MOST_RATE = 2.5e-3
"""The maximum difference between the rates of the clocks."""
_MOST_STEP, _APART = 0.25, 2
"""The maximum change of the phase over this number of windows, in ticks: one window may contain a jump."""
_STEADY = 0.8
"""Minimum share of the windows with a constant phase."""
_COARSER = range(2, 65)


class Grid(NamedTuple):
    """The mapping from the recorder's clock to the table's ticks, and its faults."""

    rate: float = 0.0  # relative rate difference of the recorder's clock to the table's
    centers: Array = np.zeros(1)  # (windows,) times on the recorder's clock, in nominal ticks
    phases: Array = np.zeros(1)  # (windows,) in ticks
    fault: str = ""  # one sentence

    def ticks(self, times: Array) -> Array:
        """Convert times on the recorder's clock (in nominal ticks) to the table's ticks; replies are at integers."""
        result: Array = times * (1.0 - self.rate) - np.interp(times, self.centers, self.phases)
        return result


def reply_grid(arrived: Array, sent: Array) -> Grid:
    """Return the grid of replies.

    Args:
        arrived: (replies,) arrival times of the complete replies at the recorder, on its clock, in nominal ticks.
        sent: (replies,) the same minus the transmission time of each reply.
    """
    for period in reversed(_COARSER):
        if max(_strength(times / period)[0] for times in (arrived, sent)) > _COMMON:
            return Grid(
                fault=f"the replies come on a grid of {period} ticks of the table, too coarse for exact times: "
                "something gathers bytes (the latency timer of a USB adapter?), the times are rounded, "
                "or control.tick_hz differs"
            )
    strength, rate = _strength(sent)
    if strength <= _LOCALLY_COMMON:
        return Grid(
            fault="the replies do not come at the table's ticks, so the exact times are unknown: something on the line "
            "gathers bytes (the latency timer of a USB adapter?), the recorder's clock runs unevenly, "
            "or control.tick_hz differs"
        )
    return _tracked(sent, rate)


def _strength(times: Array) -> tuple[float, float]:
    """Return the constant share of the phase, and the difference of the clocks' rates; times in grid periods."""
    bins = np.floor(times / _BIN_PERIODS).astype(np.int64)
    bins -= bins.min()
    turned = np.exp(2j * np.pi * times)
    sums = np.bincount(bins, turned.real) + 1j * np.bincount(bins, turned.imag)
    size = 8 * len(sums)
    spectrum, rates = np.abs(np.fft.fft(sums, size)), np.fft.fftfreq(size) / _BIN_PERIODS
    spectrum[np.abs(rates) > _MOST_RATE] = 0.0
    best = int(np.argmax(spectrum))
    return float(spectrum[best] / len(times)), float(rates[best])


def _tracked(sent: Array, rate: float) -> Grid:
    """Follow the phase from window to window: clocks drift, and setting a clock makes the phase jump."""
    windows = np.floor((sent - sent.min()) / _WINDOW_TICKS).astype(np.int64)
    turned = np.exp(2j * np.pi * sent * (1.0 - rate))
    common = [
        (float(sent[of_window].mean()), complex(turned[of_window].mean()))
        for of_window in (windows == window for window in range(int(windows.max()) + 1))
        if np.count_nonzero(of_window) >= _LEAST_IN_WINDOW
    ]
    strong = [(center, phasor) for center, phasor in common if abs(phasor) > _LOCALLY_COMMON]
    if len(strong) < max(1.0, _STEADY * len(common)):
        return Grid(fault="the recorder's clock runs unevenly: the replies have no constant phase")
    centers = np.array([center for center, _ in strong])
    phases = np.unwrap(np.angle([phasor for _, phasor in strong])) / (2.0 * np.pi)
    steps = np.abs(phases[_APART:] - phases[:-_APART])
    fault = ""
    if len(steps) and steps.max() > _MOST_STEP:
        at = int(np.argmax(steps))
        fault = (
            f"the recorder's clock jumps or runs unevenly (ticks {centers[at]:.0f} to {centers[at + _APART]:.0f}): "
            f"the phase of the replies changes by {steps[at]:.2f} ticks"
        )
    return Grid(rate, centers, phases, fault)
