"""Estimation of the constants: the most likely ones, given what was taken for granted beforehand.

The answer of a table with dry friction and backlash is rugged in its constants: the posterior has many narrow peaks on
long ridges. So the way leads from a coarse scale, at which the peaks merge, to a fine one. First Newton's method with
Levenberg's damping leads to the foot of the highest ridge, from several starts; then an evolution strategy follows it.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from tools.emulated import Array
from tools.identification.evolution_strategy import climb
from tools.identification.likelihood import Intervals

Foretell = Callable[[Array], Array]
"""Returns the angles (deg) that the readings should tell, for a vector of constants, but for the drift."""

_COARSE_SCALES_DEG = (2e-2, 8e-3, 3e-3)
_COARSE_ROUNDS = 4
_COARSE_STRIDE = 4.0

_POPULATION = 16
_FINE = ((3e-3, 20), (1.5e-3, 40), (7e-4, 40), (3e-4, 50))
"""Scales in deg, and for how many generations each."""
_ASCENTS, _STILL_RISING = 5, 3.0
"""How often at most, and by how much the posterior's logarithm must rise for one more: a climb may end half-way."""
_DRIFT_ROUNDS = 4

_CONFIDENCE_SCALE_DEG = 1.5e-3
_CONFIDENCE_STRIDE = 8.0
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

    A vector holds the constants, then the drift's knots. `steps` are the differences of the constants by which
    derivatives are taken; a constant whose step is 0 is too rugged for that, and left to the evolution strategy.
    """

    readings: Intervals
    foretell: Foretell
    drift: Array  # (readings, knots)
    prior: Prior
    steps: Array

    def angles_deg(self, vector: Array) -> Array:
        """Return the angles that the readings should tell."""
        size = len(self.steps)
        return self.foretell(vector[:size]) + self.drift @ vector[size:]

    def height(self, vector: Array, foretold_deg: Array, scale_deg: float) -> float:
        """Return the logarithm of the posterior."""
        distance = (vector - self.prior.mean) / self.prior.deviation
        return self.readings.log_likelihood(foretold_deg, scale_deg) - 0.5 * float(distance @ distance)

    def jacobian(self, vector: Array, stride: float) -> Array:
        """Return the derivatives of the foretold angles, by differences of `stride` steps each way."""
        size = len(self.steps)
        columns = np.zeros((size, len(self.drift)))
        for index, step in enumerate(self.steps * stride):
            if step:
                shift = np.zeros(size)
                shift[index] = step
                ends = (self.foretell(vector[:size] + sign * shift) for sign in (1.0, -1.0))
                columns[index] = np.subtract(*ends) / (2.0 * step)
        return np.hstack([columns.T, self.drift])

    def information(self, jacobian: Array, foretold_deg: Array, scale_deg: float) -> Array:
        """Return the negative Hessian of the logarithm, with the model taken as linear."""
        weight = self.readings.curvature(foretold_deg, scale_deg)
        result: Array = jacobian.T @ (jacobian * weight[:, None]) + np.diag(self.prior.deviation**-2.0)
        return result

    def with_drift(self, constants: Array, drift: Array, scale_deg: float) -> tuple[Array, Array]:
        """Return the vector with the likeliest drift, by Newton's method from a drift near it, and its angles."""
        size = len(self.steps)
        deviation = self.prior.deviation[size:]
        still_deg = self.foretell(constants)
        for _ in range(_DRIFT_ROUNDS if len(drift) else 0):
            foretold = still_deg + self.drift @ drift
            slope = self.drift.T @ self.readings.slope(foretold, scale_deg) - drift / deviation**2.0
            weight = self.readings.curvature(foretold, scale_deg)
            information = self.drift.T @ (self.drift * weight[:, None]) + np.diag(deviation**-2.0)
            drift = drift + np.linalg.solve(information, slope)
        return np.concatenate([constants, drift]), still_deg + self.drift @ drift


def estimate(posterior: Posterior, starts: list[Array], progress: Callable[[float], None] = lambda _: None) -> Estimate:
    """Return the highest peak found from the starts."""
    rounds = len(starts) + _ASCENTS
    feet = []
    for index, start in enumerate(starts):
        foot = _newton(posterior, start, _COARSE_SCALES_DEG[0])
        for least_deg in _COARSE_SCALES_DEG[1:]:
            foot = _newton(posterior, foot.vector, least_deg)
        feet.append(foot)
        progress((index + 1) / rounds)
    foot = _with_covariance(posterior, max(feet, key=lambda each: each.log_posterior), _COARSE_SCALES_DEG[-1])
    peak, chance = foot, np.random.default_rng(0)
    for ascent in range(_ASCENTS):
        found = _ascend(posterior, peak, foot.covariance, chance)
        rise = found.log_posterior - peak.log_posterior
        peak = found if rise > 0.0 else peak
        progress((len(starts) + ascent + 1) / rounds)
        if rise < _STILL_RISING:
            break
    return _with_covariance(posterior, peak, _CONFIDENCE_SCALE_DEG)


def _ascend(posterior: Posterior, peak: Estimate, covariance: Array, chance: np.random.Generator) -> Estimate:
    """Return a peak that is found from populations as wide as the covariance at first, then ever narrower."""
    size = len(posterior.steps)
    spread = covariance[:size, :size]
    for least_deg, generations in _FINE:
        peak, spread = _evolve(posterior, peak, spread, least_deg, generations, chance)
    return peak


def _newton(posterior: Posterior, start: Array, least_deg: float) -> Estimate:
    """Return where Newton's method comes to in a few rounds."""
    vector, foretold, damping = start, posterior.angles_deg(start), 1e-3
    scale_deg = posterior.readings.best_scale_deg(foretold, least_deg)
    for _ in range(_COARSE_ROUNDS):
        height = posterior.height(vector, foretold, scale_deg)
        jacobian = posterior.jacobian(vector, _COARSE_STRIDE)
        slope = jacobian.T @ posterior.readings.slope(foretold, scale_deg)
        slope -= (vector - posterior.prior.mean) / posterior.prior.deviation**2
        information = posterior.information(jacobian, foretold, scale_deg)
        while damping < 1e4:
            damped = information + damping * np.diag(np.diag(information))
            candidate = vector + np.clip(np.linalg.solve(damped, slope), -0.5, 0.5)
            answer = posterior.angles_deg(candidate)
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
    return _peak(posterior, vector, foretold, least_deg)


def _evolve(
    posterior: Posterior, peak: Estimate, spread: Array, least_deg: float, generations: int, chance: np.random.Generator
) -> tuple[Estimate, Array]:
    """Return the best of some generations about a peak, and the covariance of the next."""
    size = len(spread)
    scale_deg = posterior.readings.best_scale_deg(peak.foretold_deg, least_deg)

    def height(constants: Array) -> float:
        return posterior.height(*posterior.with_drift(constants, peak.vector[size:], scale_deg), scale_deg)

    summit = climb(height, peak.vector[:size], spread, _POPULATION, generations, chance)
    vector, foretold = posterior.with_drift(summit.best, peak.vector[size:], scale_deg)
    return _peak(posterior, vector, foretold, least_deg), summit.covariance


def _peak(posterior: Posterior, vector: Array, foretold_deg: Array, least_deg: float) -> Estimate:
    scale_deg = posterior.readings.best_scale_deg(foretold_deg, least_deg)
    height = posterior.height(vector, foretold_deg, scale_deg)
    return Estimate(vector, np.empty((0, 0)), height, scale_deg, foretold_deg)


def _with_covariance(posterior: Posterior, peak: Estimate, sharpest_deg: float) -> Estimate:
    """Return the peak with the covariance about it; long differences see past the ruggedness."""
    jacobian = posterior.jacobian(peak.vector, _CONFIDENCE_STRIDE)
    information = posterior.information(jacobian, peak.foretold_deg, max(peak.scale_deg, sharpest_deg))
    return peak._replace(covariance=np.linalg.inv(information).astype(np.float64))
