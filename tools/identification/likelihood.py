"""The likelihood of quantised readings: each tells an interval in which the angle lay.

What the model does not foretell is taken to be logistic, of scale s: the probability of a reading is F((high - x)/s) -
F((low - x)/s), with F the logistic function and x the foretold angle. So a reading counts by where in its interval the
angle is foretold, which tells far more than its rounding error suggests, and a wild one counts no more than linearly.
The logarithm is concave in x, and slope and curvature are simple.
"""

from typing import NamedTuple

import numpy as np
from scipy.special import expit

from tools.emulated import Array


class Intervals(NamedTuple):
    """Readings as intervals, in deg."""

    low_deg: Array
    high_deg: Array

    def log_likelihood(self, angle_deg: Array, scale_deg: float) -> float:
        """Return the logarithm of the probability of all readings, for foretold angles."""
        below = np.logaddexp(0.0, (angle_deg - self.high_deg) / scale_deg)
        above = np.logaddexp(0.0, (self.low_deg - angle_deg) / scale_deg)
        width = (self.high_deg - self.low_deg) / scale_deg
        return float(np.sum(np.log(-np.expm1(-width)) - below - above))

    def slope(self, angle_deg: Array, scale_deg: float) -> Array:
        """Return the derivative of each reading's part by its foretold angle."""
        low, high = self._at_ends(angle_deg, scale_deg)
        return (low + high - 1.0) / scale_deg

    def curvature(self, angle_deg: Array, scale_deg: float) -> Array:
        """Return the negative second derivative of each reading's part: its information about the angle."""
        low, high = self._at_ends(angle_deg, scale_deg)
        return (low * (1.0 - low) + high * (1.0 - high)) / scale_deg**2

    def best_scale_deg(self, angle_deg: Array, least_deg: float) -> float:
        """Return the most likely scale, from a grid that begins at `least_deg`."""
        scales = least_deg * np.geomspace(1.0, 1000.0, 31)
        return float(max(scales, key=lambda scale_deg: self.log_likelihood(angle_deg, scale_deg)))

    def outside_deg(self, angle_deg: Array) -> Array:
        """Return how far angles are above (or, negative, below) the intervals."""
        return angle_deg - np.clip(angle_deg, self.low_deg, self.high_deg)

    def _at_ends(self, angle_deg: Array, scale_deg: float) -> tuple[Array, Array]:
        return expit((self.low_deg - angle_deg) / scale_deg), expit((self.high_deg - angle_deg) / scale_deg)
