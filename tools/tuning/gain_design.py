"""Gain design: the best gain set, in the firmware's resolution, within bounds.

A search over a grid of all three gains that zooms in on the best point. Each candidate is rounded to the firmware's
registers before it is judged, so the result is valid for the firmware. Among candidates that satisfy the bounds the
objective decides, otherwise the total excess. So if nothing satisfies the bounds, the result is the nearest candidate.
"""

from collections.abc import Callable
from operator import attrgetter
from typing import NamedTuple

import numpy as np

from emulator.firmware.fixed_point import GAIN_BITS, INTEGRAL_GAIN_BITS
from emulator.firmware.pid import Gains
from emulator.int32 import INT32_MAX
from tools.bounds import Bound, violation
from tools.tuning.frequency_response import Array
from tools.tuning.linear_model import Teeth, speed_quantum_deg_s, time_constant_s
from tools.tuning.loop_figures import LoopFigures, Loops, joined, loop_figures

Objective = Callable[[LoopFigures], Array]

LEAST_LAG: Objective = attrgetter("ramp_lag_s")
LEAST_LOAD_PEAK: Objective = attrgetter("load_peak_deg_s_Nm")

_COARSE = (18, 18, 9)
_FINE = (7, 7, 7)
ZOOMS = 6
_BINDING_SHARE = 0.02
_BATCH = 1 << 20
"""Maximum number of candidates times frequencies that are judged at once, because of the memory."""


class Design(NamedTuple):
    """A gain set with its figures and bounds: the result of a search, or given."""

    gains: Gains
    figures: LoopFigures  # of this one gain set, arrays of shape (1,)
    bounds: tuple[Bound, ...]

    @property
    def broken(self) -> tuple[Bound, ...]:
        """The bounds that the gains violate; a loop that is not stable violates all."""
        if not self.figures.stable[0]:
            return self.bounds
        return tuple(bound for bound in self.bounds if not bound.excess(self.figures)[0] <= 0.0)  # NaN satisfies none

    def stated(self, bound: Bound) -> str:
        """Return a bound with the value of these gains, as text."""
        return f"{bound.title} {bound.shown(float(getattr(self.figures, bound.figure)[0]))} (required: {bound.asked})"

    @property
    def binding(self) -> tuple[Bound, ...]:
        """The bounds that prevent better gains: those that are nearly reached."""
        return tuple(bound for bound in self.bounds if bound.excess(self.figures)[0] > -_BINDING_SHARE)


class Scan(NamedTuple):
    """The whole search box in coarse steps, judged once for all bounds and objectives."""

    loops: Loops
    points: Array
    figures: LoopFigures
    reach: Array  # the steps


def scan(loops: Loops) -> Scan:
    """Return the coarse scan of one table's loops."""
    low, high = _search_box(loops)
    points, reach = _grid(low, high, _COARSE)
    return Scan(loops, points, _figures(loops, points), reach)


def design(scanned: Scan, bounds: tuple[Bound, ...], objective: Objective, zooms: int = ZOOMS) -> Design:
    """Return the gain set with the minimum `objective` within the bounds.

    Args:
        scanned: the coarse scan of the table's loops.
        bounds: the bounds for the gain set.
        objective: the figure of a loop to minimize, such as `LEAST_LAG` or `LEAST_LOAD_PEAK`.
        zooms: number of zoom steps of the search; each makes the grid three times as fine.
    """
    loops, reach = scanned.loops, scanned.reach
    best = scanned.points[_best(scanned.figures, bounds, objective)]
    for _ in range(zooms):
        points, reach = _grid(best - reach, best + reach, _FINE)
        best = points[_best(_figures(loops, points), bounds, objective)]
    return judged(loops, Gains(*(int(value) for value in _registers(loops, best[None])[0])), bounds)


def judged(loops: Loops, gains: Gains, bounds: tuple[Bound, ...]) -> Design:
    """Return a given gain set with its figures."""
    return Design(gains, loop_figures(loops, np.array([gains])), bounds)


def _grid(low: Array, high: Array, counts: tuple[int, ...]) -> tuple[Array, Array]:
    """Return all points of a grid, and its steps."""
    axes = [np.linspace(start, end, count) for start, end, count in zip(low, high, counts, strict=True)]
    points = np.stack([axis.ravel() for axis in np.meshgrid(*axes, indexing="ij")], axis=-1)
    return points, np.array([axis[1] - axis[0] for axis in axes])


def _figures(loops: Loops, points: Array) -> LoopFigures:
    registers = _registers(loops, points)
    batches = np.array_split(registers, -(-registers.shape[0] * len(loops.z) // _BATCH))
    return joined([loop_figures(loops, batch) for batch in batches])


def _best(figures: LoopFigures, bounds: tuple[Bound, ...], objective: Objective) -> int:
    broken = violation(bounds, figures)
    if broken.min() > 0.0:
        return int(np.argmin(broken))
    return int(np.argmin(np.where(broken > 0.0, np.inf, objective(figures))))


def _search_box(loops: Loops) -> tuple[Array, Array]:
    """Return the corners of the search: the logarithms of K times the plant's gain and of Ti, and Td over the window.

    The delay of the loop, about half of the window plus two ticks, limits the gains. A slow motor without load is an
    integrator over the delay. Then it allows a gain in proportion to its time constant.
    """
    control = loops.config.control
    delay_s = (control.speed_window_ticks / 2 + 2) / control.tick_hz
    slowness = max(time_constant_s(loops.config, Teeth.FREE) / delay_s, 1.0)
    low = [np.log(0.05), np.log(0.2 * delay_s), 0.0]
    return np.array(low), np.array([np.log(5.0 * slowness), np.log(20.0 * delay_s), 1.0])


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
    least = np.array([1.0, 1.0, 0.0])  # the configuration states the others in proportion to the first
    result: Array = np.clip(np.round(scaled), least, INT32_MAX)
    return result
