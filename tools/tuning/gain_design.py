"""Gain design: the best gain set that the firmware can hold, within bounds.

A search over a grid of all three gains that zooms in on the best point. Each candidate is rounded to the firmware's
registers before it is judged, so the result is what will run. Among candidates that keep the bounds the objective
decides, otherwise how little they break them; so when nothing keeps the bounds, the best that can be had comes out.
"""

from typing import NamedTuple

import numpy as np

from emulator.fixed_point import GAIN_BITS, INT32_MAX, INTEGRAL_GAIN_BITS
from emulator.pid import Gains
from tools.tuning.bounds import Bound, violation
from tools.tuning.frequency_response import Array
from tools.tuning.linear_model import speed_quantum_deg_s
from tools.tuning.loop_figures import LoopFigures, Loops, loop_figures

LEAST_LAG = "ramp_lag_s"
LEAST_LOAD_PEAK = "load_peak_deg_s_Nm"

_COARSE = (18, 18, 9)
_FINE = (7, 7, 7)
_ZOOMS = 6
_BINDING_SHARE = 0.02


class Design(NamedTuple):
    """The outcome of a search."""

    gains: Gains
    figures: LoopFigures  # of this one gain set, arrays of shape (1,)
    bounds: tuple[Bound, ...]

    @property
    def broken(self) -> tuple[Bound, ...]:
        """The bounds that even the best gains break."""
        return tuple(bound for bound in self.bounds if bound.excess(self.figures)[0] > 0.0)

    @property
    def binding(self) -> tuple[Bound, ...]:
        """The bounds that keep the gains from being better: those that are nearly reached."""
        return tuple(bound for bound in self.bounds if bound.excess(self.figures)[0] > -_BINDING_SHARE)


def design(loops: Loops, bounds: tuple[Bound, ...], objective: str) -> Design:
    """Return the gain set with the least `objective`, a field of `LoopFigures`, within the bounds.

    Args:
        loops: The loops of one table.
        bounds: What the gain set must keep.
        objective: `LEAST_LAG` or `LEAST_LOAD_PEAK`.
    """
    low, high = _search_box(loops)
    best = np.zeros(3)
    for zoom in range(_ZOOMS + 1):
        counts = _FINE if zoom else _COARSE
        axes = [np.linspace(start, end, count) for start, end, count in zip(low, high, counts, strict=True)]
        points = np.stack([axis.ravel() for axis in np.meshgrid(*axes, indexing="ij")], axis=-1)
        figures = loop_figures(loops, _registers(loops, points))
        best = points[_best(figures, bounds, objective)]
        reach = np.array([axis[1] - axis[0] for axis in axes])
        low, high = best - reach, best + reach
    gains = Gains(*(int(value) for value in _registers(loops, best[None])[0]))
    return Design(gains, loop_figures(loops, np.array([gains])), bounds)


def _best(figures: LoopFigures, bounds: tuple[Bound, ...], objective: str) -> int:
    broken = violation(bounds, figures)
    if broken.min() > 0.0:
        return int(np.argmin(broken))
    return int(np.argmin(np.where(broken > 0.0, np.inf, getattr(figures, objective))))


def _search_box(loops: Loops) -> tuple[Array, Array]:
    """Return the corners of the search: the logarithms of K times the plant's gain and of Ti, and Td over the window.

    The delay of the loop, about half the window and two ticks, is the only time scale that limits the gains.
    """
    control = loops.config.control
    delay_s = (control.speed_window_ticks / 2 + 2) / control.tick_hz
    return np.array([np.log(0.05), np.log(0.2 * delay_s), 0.0]), np.array([np.log(5.0), np.log(20.0 * delay_s), 1.0])


def _registers(loops: Loops, points: Array) -> Array:
    """Return the registers (n, 3) of points of the search box."""
    config = loops.config
    tick_s = 1.0 / config.control.tick_hz
    duty_s_deg = np.exp(points[:, 0]) / loops.speed_gain_deg_s[0]
    steps = duty_s_deg * config.driver.duty_max * speed_quantum_deg_s(config)
    integral = steps * tick_s / np.exp(points[:, 1])
    derivative = steps * np.maximum(points[:, 2], 0.0) * config.control.speed_window_ticks
    scaled = np.stack(
        [steps * 2.0**GAIN_BITS, integral * 2.0**INTEGRAL_GAIN_BITS, derivative * 2.0**GAIN_BITS], axis=-1
    )
    least = np.array([0.0, 1.0, 0.0])
    result: Array = np.clip(np.round(scaled), least, INT32_MAX)
    return result
