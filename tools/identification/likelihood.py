"""The likelihood of quantized readings: each reading is an interval that contained the angle.

The prediction error has a logistic distribution with scale s: a reading has the probability F((high - x)/s) - F((low -
x)/s), with the logistic function F and the predicted angle x. A reading near the edge of its interval constrains the
angle far more than the width of the interval. An outlier counts only linearly. The logarithm is concave in x, and its
derivatives are simple.
"""

from typing import NamedTuple

import numpy as np
from scipy.special import expit

from tools.emulated import Array

Scale = float | Array
"""Scale of the prediction error in deg: one for all readings, or (readings,)."""


class Intervals(NamedTuple):
    """Readings as intervals, in deg."""

    low_deg: Array
    high_deg: Array

    def part(self, rows: slice) -> "Intervals":
        """Return some of the readings."""
        return Intervals(self.low_deg[rows], self.high_deg[rows])

    def log_likelihood(self, angle_deg: Array, scale_deg: Scale) -> float:
        """Return the logarithm of the probability of all readings, for predicted angles."""
        above, below = self._outside(angle_deg, scale_deg)
        width = (self.high_deg - self.low_deg) / scale_deg
        return float(np.sum(np.log(-np.expm1(-width)) - _softplus(above) - _softplus(below)))

    def derivatives(self, angle_deg: Array, scale_deg: Scale) -> tuple[Array, Array]:
        """Return slope and negative curvature of each reading's logarithm by its predicted angle.

        The negative curvature is the reading's information about the angle.
        """
        above, below = (expit(distance) for distance in self._outside(angle_deg, scale_deg))
        return (below - above) / scale_deg, (below * (1.0 - below) + above * (1.0 - above)) / scale_deg**2

    def best_scale_deg(self, angle_deg: Array, least_deg: float) -> float:
        """Return the most likely scale, from a grid that starts at `least_deg`."""
        scales = least_deg * np.geomspace(1.0, 1000.0, 31)
        return float(max(scales, key=lambda scale_deg: self.log_likelihood(angle_deg, scale_deg)))

    def outside_deg(self, angle_deg: Array) -> Array:
        """Return the distance of angles above (or, negative, below) the intervals."""
        return angle_deg - np.clip(angle_deg, self.low_deg, self.high_deg)

    def _outside(self, angle_deg: Array, scale_deg: Scale) -> tuple[Array, Array]:
        """Return the signed distances above the upper and below the lower edges, in scales."""
        return (angle_deg - self.high_deg) / scale_deg, (self.low_deg - angle_deg) / scale_deg


def _softplus(x: Array) -> Array:
    """Return log(1 + exp(x)) without overflow."""
    positive: Array = np.maximum(x, 0.0) + np.log1p(np.exp(-np.abs(x)))
    return positive
