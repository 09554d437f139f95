"""The lag of a table behind its reference, estimated from its readings during the recording.

A reading is rounded, mostly to a tenth of a degree. It contains most information when the table is about to pass from
one rounded value to the next, so the recorder predicts that time. The lag is assumed to be linear in speed, direction
and acceleration; each reading gives an interval for it. This is a Kalman filter whose measurements are intervals. The
predicted normal distribution, cut to the interval, is replaced by a normal one of the same mean and variance.
"""

from collections.abc import Callable
from math import copysign, erf, exp, floor, pi, sqrt

import numpy as np

from tools.emulated import Array
from tools.identification.excitation import Reference

_MEAN = (3.5e-3, 0.05, 8e-5, 5e-5)
_DEVIATION = (3e-3, 0.03, 1e-4, 1e-4)
_UNPREDICTED_DEG = 0.006
_FORGETTING, _SURPRISED = 1.001, 1.1
_SURPRISE = 1e-3
_WIDEST = 30.0
"""Maximum deviation, as a multiple of the first one: a table that has slipped deviates without limit."""
_LOOK_S = 0.002


class LagTracker:
    """An estimate of the lag, updated by the readings."""

    def __init__(self) -> None:
        """Start with the lag of a usual table."""
        self._mean = np.array(_MEAN)
        self._covariance = np.diag(np.square(_DEVIATION))

    def lag_deg(self, reference: Reference) -> float:
        """Return the present lag of the encoder behind the reference."""
        return float(_features(reference) @ self._mean)

    def learn(self, reference: Reference, low_deg: float, high_deg: float) -> None:
        """Update the estimate: the lag was in an interval."""
        if reference.speed_deg_s == 0.0:
            return
        features = _features(reference)
        spread = self._covariance @ features
        variance = float(features @ spread) + _UNPREDICTED_DEG**2
        deviation, predicted = sqrt(variance), float(features @ self._mean)
        low, high = (low_deg - predicted) / deviation, (high_deg - predicted) / deviation
        probability = _normal(high) - _normal(low)
        self._forget(_FORGETTING if probability >= _SURPRISE else _SURPRISED)
        if probability < _SURPRISE:
            return
        shift = (_density(low) - _density(high)) / probability
        narrowing = min(shift**2 - (low * _density(low) - high * _density(high)) / probability, 1.0)
        self._mean = self._mean + spread * shift / deviation
        self._covariance = self._covariance - np.outer(spread, spread) * narrowing / variance

    def _forget(self, factor: float) -> None:
        deviation = np.sqrt(factor * np.diag(self._covariance))
        shrink = np.minimum(1.0, _WIDEST * np.array(_DEVIATION) / deviation)
        self._covariance *= factor * np.outer(shrink, shrink)


def next_passage_s(position_deg: Callable[[float], float], step_deg: float, begin_s: float, within_s: float) -> float:
    """Return the time of the next change of a rounded position, or `begin_s` if it is not soon."""
    time_s, at = begin_s, position_deg(begin_s) / step_deg - 0.5
    while time_s < begin_s + within_s:
        later = position_deg(time_s + _LOOK_S) / step_deg - 0.5
        if floor(later) != floor(at):
            edge = floor(max(at, later)) if later > at else floor(at)
            return time_s + _LOOK_S * (edge - at) / (later - at)
        time_s, at = time_s + _LOOK_S, later
    return begin_s


def _features(reference: Reference) -> Array:
    speed, acceleration = reference.speed_deg_s, reference.acceleration_deg_s2
    speeding_up = acceleration * speed > 0.0
    return np.array(
        (speed, copysign(1.0, speed), acceleration if speeding_up else 0.0, 0.0 if speeding_up else acceleration)
    )


def _normal(x: float) -> float:
    return 0.5 * (1.0 + erf(x / sqrt(2.0)))


def _density(x: float) -> float:
    return exp(-0.5 * x * x) / sqrt(2.0 * pi)
