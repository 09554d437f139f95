"""Estimation of the constants: the most likely ones, given what was taken for granted beforehand.

Newton's method on the posterior, with Levenberg's damping. The answer of a table with dry friction and backlash is
rugged in its constants, so the way is long: first with a coarse scale, from several backlashes, then finer, and last
along the ridges through each peak.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from tools.emulated import Array
from tools.identification.likelihood import Intervals

Foretell = Callable[[Array], Array]
"""Returns the angles (deg) that the readings should tell, for a vector of constants."""

_COARSE_SCALES_DEG = (2e-2, 8e-3)
_SCALES_DEG = (3e-3, 1e-3, 3e-4, 1e-4)
_RIDGE_STEPS = (-1.5, -0.7, 0.7, 1.5)
_CLIMBED_ON = 3

_RIDGE_SCALE_DEG = 1e-3
_CONFIDENCE_SCALE_DEG = 1.5e-3
"""The covariance sees the readings no sharper than so: closer by, what it would tell of is one of many narrow peaks."""


class Prior(NamedTuple):
    """What is taken for granted: mean and standard deviation of each component."""

    mean: Array
    deviation: Array


class Estimate(NamedTuple):
    """A peak of the posterior."""

    vector: Array
    covariance: Array
    log_posterior: float
    scale_deg: float  # of what the model does not foretell
    foretold_deg: Array


class Posterior(NamedTuple):
    """The problem: readings, model and prior.

    `steps` are the differences by which derivatives are taken, `assumed` the components that readings hardly tell.
    """

    readings: Intervals
    foretell: Foretell
    prior: Prior
    steps: Array
    assumed: tuple[int, ...]

    def height(self, vector: Array, foretold_deg: Array, scale_deg: float) -> float:
        """Return the logarithm of the posterior."""
        distance = (vector - self.prior.mean) / self.prior.deviation
        return self.readings.log_likelihood(foretold_deg, scale_deg) - 0.5 * float(distance @ distance)

    def jacobian(self, vector: Array, stride: float) -> Array:
        """Return the derivatives of the foretold angles, by differences of `stride` steps each way."""
        columns = []
        for index, step in enumerate(self.steps * stride):
            shift = np.zeros_like(vector)
            shift[index] = step
            columns.append((self.foretell(vector + shift) - self.foretell(vector - shift)) / (2.0 * step))
        return np.array(columns).T

    def information(self, jacobian: Array, foretold_deg: Array, scale_deg: float) -> Array:
        """Return the negative Hessian of the logarithm, with the model taken as linear."""
        weight = self.readings.curvature(foretold_deg, scale_deg)
        result: Array = jacobian.T @ (jacobian * weight[:, None]) + np.diag(self.prior.deviation**-2.0)
        return result


def estimate(posterior: Posterior, starts: list[Array], progress: Callable[[float], None] = lambda _: None) -> Estimate:
    """Return the highest peak found from the starts."""
    rounds = len(starts) + 3 * len(_SCALES_DEG)
    climbed = []
    for index, start in enumerate(starts):
        peak = _climb(posterior, start, _COARSE_SCALES_DEG[0], stride=4.0, rounds=4)
        for least_deg in (_COARSE_SCALES_DEG[1], _SCALES_DEG[0]):
            peak = _climb(posterior, peak.vector, least_deg, stride=4.0, rounds=4)
        climbed.append(peak)
        progress((index + 1) / rounds)
    best = max(climbed, key=lambda peak: peak.log_posterior)
    for index, least_deg in enumerate(_SCALES_DEG):
        for stride in (4.0, 2.0, 1.0):
            best = _climb(posterior, best.vector, least_deg, stride, rounds=5)
        if least_deg < _RIDGE_SCALE_DEG:
            best = _along_ridges(posterior, best, least_deg)
        progress((len(starts) + 3 * (index + 1)) / rounds)
    return _with_covariance(posterior, best, _CONFIDENCE_SCALE_DEG)


def _along_ridges(posterior: Posterior, peak: Estimate, least_deg: float) -> Estimate:
    """Return a higher peak on the ridges through this one, or this one.

    Where one of the assumed constants is another, the readings can be explained nearly as well by other values of the
    rest: these lie on a ridge, and its peaks are narrow.
    """
    covariance = _with_covariance(posterior, peak, _RIDGE_SCALE_DEG).covariance
    begins = [
        peak.vector + step * posterior.prior.deviation[index] * covariance[index] / covariance[index, index]
        for index in posterior.assumed
        for step in _RIDGE_STEPS
    ]
    tried = [_climb(posterior, begin, least_deg, 2.0, rounds=2) for begin in begins]
    best = sorted(tried, key=lambda each: each.log_posterior)[-_CLIMBED_ON:]
    for stride in (2.0, 1.0):
        best = [_climb(posterior, each.vector, least_deg, stride, rounds=5) for each in best]
    return max(peak, *best, key=lambda each: each.log_posterior)


def _climb(posterior: Posterior, start: Array, least_deg: float, stride: float, rounds: int) -> Estimate:
    """Return where Newton's method comes to in a number of rounds."""
    vector, foretold, damping = start, posterior.foretell(start), 1e-3
    scale_deg = posterior.readings.best_scale_deg(foretold, least_deg)
    for _ in range(rounds):
        height = posterior.height(vector, foretold, scale_deg)
        jacobian = posterior.jacobian(vector, stride)
        slope = jacobian.T @ posterior.readings.slope(foretold, scale_deg)
        slope -= (vector - posterior.prior.mean) / posterior.prior.deviation**2
        information = posterior.information(jacobian, foretold, scale_deg)
        while damping < 1e4:
            damped = information + damping * np.diag(np.diag(information))
            candidate = vector + np.clip(np.linalg.solve(damped, slope), -0.5, 0.5)
            answer = posterior.foretell(candidate)
            gain = posterior.height(candidate, answer, scale_deg) - height
            if gain > 0.0:
                break
            damping *= 5.0
        else:
            break
        vector, foretold, damping = candidate, answer, max(damping / 5.0, 1e-6)
        scale_deg = posterior.readings.best_scale_deg(foretold, least_deg)
        if gain < 0.05:
            break
    height = posterior.height(vector, foretold, scale_deg)
    return Estimate(vector, np.empty((0, 0)), height, scale_deg, foretold)


def _with_covariance(posterior: Posterior, peak: Estimate, sharpest_deg: float) -> Estimate:
    """Return the peak with the covariance about it; long differences see past the ruggedness."""
    jacobian = posterior.jacobian(peak.vector, 8.0)
    information = posterior.information(jacobian, peak.foretold_deg, max(peak.scale_deg, sharpest_deg))
    return peak._replace(covariance=np.linalg.inv(information).astype(np.float64))
