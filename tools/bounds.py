"""The bounds for a gain set, and its distance from each."""

from math import ceil, floor, isinf, log10
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:  # the command line shows the limits without loading what computes the figures
    from tools.tuning.loop_figures import LoopFigures

Array = NDArray[np.float64]

_EASE = 0.01


class TuningError(ValueError):
    """An option that cannot be used, or bounds that cannot be satisfied. The message states which, and what works."""


class Bound(NamedTuple):
    """One bound on one figure."""

    figure: str  # a field of `LoopFigures`
    title: str
    limit: float
    at_most: bool
    scale: float  # conversion from the figure's unit to the displayed one
    unit: str
    flag: str  # option of the command line, in the displayed unit

    def excess(self, figures: "LoopFigures") -> Array:
        """Return by how much the figure exceeds the limit, as a share of it; negative if the bound is satisfied."""
        value = getattr(figures, self.figure)
        share: Array = value / self.limit - 1.0 if self.at_most else 1.0 - value / self.limit
        return share

    def shown(self, value: float) -> str:
        """Return a value of this figure with its unit."""
        if isinf(value):
            return "not reached"
        return f"{value * self.scale:.3g}{self.unit}"

    def allowing(self, value: float) -> float:
        """Return a limit of two digits that the value satisfies with a small margin."""
        eased = value * (1.0 + _EASE if self.at_most else 1.0 - _EASE)
        power = 10.0 ** (floor(log10(abs(eased))) - 1)
        return float((ceil if self.at_most else floor)(eased / power) * power)

    @property
    def option(self) -> str:
        """The bound as an option of the command line."""
        return f"{self.flag} {self.limit * self.scale:.6g}"

    @property
    def asked(self) -> str:
        """The limit as text."""
        return f"{'at most' if self.at_most else 'at least'} {self.shown(self.limit)}"

    def __str__(self) -> str:
        """Return the bound as text."""
        return f"{self.title} {self.asked}"


class Limits(NamedTuple):
    """The user's choices."""

    sensitivity_peak: float = 1.7
    gain_margin_db: float = 8.0
    phase_margin_deg: float = 40.0
    noise_duty: float = 0.0062
    bandwidth_hz: float = 10.0
    overshoot: float = 0.10
    settling_s: float = 0.1

    def for_ramp(self) -> tuple[Bound, ...]:
        """Return the bounds of the ramp set."""
        return (
            Bound("sensitivity_peak", "Ms", self.sensitivity_peak, True, 1.0, "", "--ms"),
            Bound("gain_margin_db", "gain margin", self.gain_margin_db, False, 1.0, " dB", "--gain-margin"),
            Bound("phase_margin_deg", "phase margin", self.phase_margin_deg, False, 1.0, " deg", "--phase-margin"),
            Bound("noise_duty", "noise at the PWM", self.noise_duty, True, 100.0, " % duty", "--noise"),
            Bound("bandwidth_hz", "bandwidth", self.bandwidth_hz, False, 1.0, " Hz", "--bandwidth"),
        )

    def for_hold(self) -> tuple[Bound, ...]:
        """Return the bounds of the constant-speed set: those of the ramp set, and a well-damped step response."""
        return (
            *self.for_ramp(),
            Bound("overshoot", "overshoot", self.overshoot, True, 100.0, " %", "--overshoot"),
            Bound("settling_s", "settling", self.settling_s, True, 1e3, " ms", "--settling"),
        )


def violation(bounds: tuple[Bound, ...], figures: "LoopFigures") -> Array:
    """Return the sum of all excesses: 0 if all bounds are satisfied; an unstable loop satisfies none."""
    total = np.sum([np.maximum(bound.excess(figures), 0.0) for bound in bounds], axis=0)
    result: Array = np.where(figures.stable, total, np.inf)
    return result
