"""Estimation of the constants: the most likely ones, given what was taken for granted beforehand.

Newton's method on the posterior, with Levenberg's damping. The answer of a table with dry friction and backlash is
rugged in its constants, so the way is long: first with a coarse scale, from several backlashes, then finer, and from
each peak a few draws from its surroundings are tried for a better one.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from tools.emulated import Array
from tools.identification.likelihood import Intervals

Foretell = Callable[[Array], Array]
"""Returns the angles (deg) that the readings should tell, for a vector of constants."""

_COARSE_SCALES_DEG = (2e-2, 8e-3)
_SCALES_DEG = (3e-3, 1e-3, 3e-4)
_DRAWS = 40


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
    """The problem: readings, model and prior; `steps` are the differences by which derivatives are taken."""

    readings: Intervals
    foretell: Foretell
    prior: Prior
    steps: Array

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


def estimate(
    posterior: Posterior, starts: list[Array], seed: int, progress: Callable[[float], None] = lambda _: None
) -> Estimate:
    """Return the highest peak found from the starts; the same seed gives the same one."""
    chance = np.random.default_rng(seed)
    rounds = len(starts) + len(_SCALES_DEG)
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
        best = _better_nearby(posterior, best, least_deg, chance)
        progress((len(starts) + index + 1) / rounds)
    return _with_covariance(posterior, best)


def _better_nearby(posterior: Posterior, peak: Estimate, least_deg: float, chance: np.random.Generator) -> Estimate:
    """Return a higher peak near to this one, or this one."""
    spread = np.linalg.cholesky(_with_covariance(posterior, peak).covariance)
    draws = peak.vector + chance.standard_normal((_DRAWS, len(peak.vector))) @ spread.T

    def height(vector: Array) -> float:
        foretold = posterior.foretell(vector)
        return posterior.height(vector, foretold, posterior.readings.best_scale_deg(foretold, least_deg))

    start = max(draws, key=height)
    for stride in (2.0, 1.0):
        start = _climb(posterior, start, least_deg, stride, rounds=5).vector
    other = _climb(posterior, start, least_deg, 1.0, rounds=1)
    return max(peak, other, key=lambda each: each.log_posterior)


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


def _with_covariance(posterior: Posterior, peak: Estimate) -> Estimate:
    """Return the peak with the covariance about it; long differences see past the ruggedness."""
    jacobian = posterior.jacobian(peak.vector, 8.0)
    information = posterior.information(jacobian, peak.foretold_deg, peak.scale_deg)
    return peak._replace(covariance=np.linalg.inv(information).astype(np.float64))
