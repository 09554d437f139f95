"""Estimation of the constants: the maximum of the posterior, by an iterated ensemble smoother.

The posterior has many narrow peaks on long ridges. Each round simulates an ensemble of constants, fits a linear model
to the simulated angles, maximizes the posterior of that model, and moves there if the simulation confirms it. The first
rounds accept prediction errors of a hundredth of a degree, at which the peaks merge; the last rounds a fraction of a
count. Several chains start from different values of the backlash; the better ones continue at each level.

Method: Y. Chen and D. Oliver, "Levenberg-Marquardt forms of the iterative ensemble smoother", Computational Geosciences
17 (2013) 689-703; here with the likelihood of intervals instead of a normal one.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag

from tools.emulated import Array
from tools.identification.ensemble import Ensemble, drawn, regressed
from tools.identification.likelihood import Intervals

DEBUG = False
Predict = Callable[[Array], Array]
"""Returns the angles (deg) that the readings should show, for a vector of constants, without the drift."""


class Level(NamedTuple):
    """A part of the search."""

    least_deg: float  # the scale
    rounds: int  # at most
    members: int  # of an ensemble
    survivors: int  # chains that continue afterwards
    enough: float = -np.inf  # the level ends once the heights rise by less within some rounds


COMMON_LEVEL = Level(2e-2, 5, 28, 1)
"""All chains together, before they fork."""

LEVELS = (
    Level(1e-2, 2, 28, 5),
    Level(5e-3, 2, 28, 3),
    Level(2.5e-3, 2, 28, 2),
    Level(1.2e-3, 2, 32, 2),
)

FINE_LEVELS = (
    Level(6e-4, 3, 32, 2),
    Level(3e-4, 18, 36, 2, enough=3.0),
)
"""After the best chain has forked once more."""

_FORK = (-0.13, 0.13)
"""By how much the forked constant differs then, in standard units."""

_FIRST_SPREAD = 0.25
"""Standard deviation of the first ensemble, as a share of the prior's."""

_PATIENCE = 4
"""For how many rounds a rise is counted."""

_SAME_SHARE, _LEAST_CHAINS = 0.2, 2
"""Chains whose predictions differ by less than this share of the scale are on the same peak."""

_REACH = (0.25, 4.0)
"""Least and greatest covariance of an ensemble, as a share of the posterior's."""
_SHORTER, _LONGER = 0.3, 1.5
_TRUST = 2.0
"""How far a step leads at most, in standard deviations of the ensemble."""
_STEPS = (1.0, 0.5, 0.25)

_NEWTON_ROUNDS, _NEWTON_GAIN = 12, 0.05
_DRIFT_ROUNDS, _DRIFT_GAIN = 6, 0.01

_CONFIDENCE_SCALE_DEG = 1.5e-3
"""The covariance counts no reading as more accurate than this: finer detail belongs to one of many narrow peaks."""
_CONFIDENCE_MEMBERS = (60, 60, 120)
_LEAST_INFORMATION = 0.05
"""The share of an information that is left at least after noise is subtracted from it."""
_EQUAL_HEIGHT = 8.0
"""A peak that is lower by this is less likely by a factor e: the height of a narrow peak is partly chance."""


class Estimate(NamedTuple):
    """A peak of the posterior, in standard units."""

    vector: Array
    covariance: Array
    likelihood_information: Array  # about the constants and the drift, without the prior
    log_posterior: float
    scale_deg: float  # of the prediction error
    predicted_deg: Array


class Posterior(NamedTuple):
    """The problem: readings and model.

    A vector holds the constants, then the coefficients of the drift, both in standard units: beforehand each component
    is normally distributed with mean 0 and standard deviation 1.
    """

    readings: Intervals
    predict: Predict
    drift: Array  # (readings, coefficients)
    size: int  # how many constants

    def height(self, vector: Array, predicted_deg: Array, scale_deg: float) -> float:
        """Return the logarithm of the posterior."""
        return self.readings.log_likelihood(predicted_deg, scale_deg) - 0.5 * float(vector @ vector)

    def with_drift(self, constants: Array, drift: Array, scale_deg: float) -> tuple[Array, Array]:
        """Return the vector with the likeliest drift, by Newton's method from a drift near it, and its angles."""
        basis = np.vstack([np.zeros((self.size, len(drift))), np.eye(len(drift))])
        model = _LinearPosterior(
            self, np.concatenate([constants, drift]), basis, self.predict(constants) + self.drift @ drift, self.drift
        )
        move = model.maximum(scale_deg, np.full(len(drift), np.inf), _DRIFT_ROUNDS, _DRIFT_GAIN)
        return model.origin + basis @ move, model.still_deg + self.drift @ move


class _Chain(NamedTuple):
    """A search: where it is, and how its next ensemble is spread."""

    vector: Array
    predicted_deg: Array
    covariance: Array  # of the constants
    reach: float
    height: float  # at the best scale of its level


def estimate(
    posterior: Posterior, forked: int, values: list[float], progress: Callable[[float], None] = lambda _: None
) -> Estimate:
    """Return the highest peak found, with a covariance that includes other peaks of about its height.

    Args:
        posterior: The problem.
        forked: The index of the constant in which the chains differ at first.
        values: Its value in each chain.
        progress: Called with the share that is done.
    """
    chance = np.random.default_rng(0)
    levels = (COMMON_LEVEL, *LEVELS, *FINE_LEVELS)
    first = _FIRST_SPREAD**2 * np.eye(posterior.size)
    chains = [_Chain(np.zeros(posterior.size + posterior.drift.shape[1]), np.empty(0), first, _REACH[1], -np.inf)]
    for done, level in enumerate(levels):
        if level is LEVELS[0]:
            chains = [_forked(chains[0], first, forked, value) for value in values]
        if level is FINE_LEVELS[0]:
            best = chains[0]
            chains += [_forked(best, best.covariance, forked, best.vector[forked] + shift) for shift in _FORK]
        heights = [-np.inf] * _PATIENCE
        for turn in range(level.rounds):
            chains = [_advanced(posterior, chain, level, chance) for chain in chains]
            progress((done + (turn + 1) / level.rounds) / len(levels))
            heights.append(max(chain.height for chain in chains))
            if heights[-1] - heights[-1 - _PATIENCE] < level.enough:
                break
        if DEBUG:
            print(
                "    ",
                level.least_deg,
                turn + 1,
                [(round(c.height, 1), round(float(np.exp(np.log(10) + 1.5 * c.vector[3])), 2)) for c in chains],
                flush=True,
            )
        chains = _survivors(chains, level)
    return _with_covariance(posterior, chains, chance)


def _survivors(chains: list[_Chain], level: Level) -> list[_Chain]:
    """Return the highest chains; of those that predict the same only one, but two chains at least."""
    first, *others = sorted(chains, key=lambda chain: -chain.height)
    kept, copies = [first], []
    for chain in others:
        apart_deg = min(float(np.std(chain.predicted_deg - other.predicted_deg)) for other in kept)
        (kept if apart_deg > _SAME_SHARE * level.least_deg else copies).append(chain)
    kept += copies[: max(0, _LEAST_CHAINS - len(kept))]
    return kept[: level.survivors]


def _forked(chain: _Chain, first: Array, index: int, value: float) -> _Chain:
    vector = chain.vector.copy()
    vector[index] = value
    return _Chain(vector, np.empty(0), first, _REACH[1], -np.inf)


def _advanced(posterior: Posterior, chain: _Chain, level: Level, chance: np.random.Generator) -> _Chain:
    """Return a chain after one round: ensemble, linear model, step, and the spread of the next ensemble."""
    size, drift = posterior.size, chain.vector[posterior.size :]
    ensemble = drawn(posterior.predict, chain.vector[:size], chain.covariance, level.members, chance)
    model = _LinearPosterior.of(posterior, ensemble, drift)
    scale_deg = posterior.readings.best_scale_deg(model.still_deg, level.least_deg)
    reachable = np.array([_TRUST] * size + [np.inf] * len(drift))
    move = model.maximum(scale_deg, reachable, _NEWTON_ROUNDS, _NEWTON_GAIN)

    if not len(chain.predicted_deg):
        vector, predicted_deg = posterior.with_drift(ensemble.center, drift, scale_deg)
        chain = chain._replace(vector=vector, predicted_deg=predicted_deg)
    height = posterior.height(chain.vector, chain.predicted_deg, scale_deg)
    heights = [
        posterior.height(np.concatenate([ensemble.center + ensemble.root @ unit, drift]), angles_deg, scale_deg)
        for unit, angles_deg in zip(ensemble.units, ensemble.values + posterior.drift @ drift, strict=True)
    ]
    units = [*(share * move[:size] for share in _STEPS), ensemble.units[int(np.argmax(heights))]]
    reach = max(chain.reach * _SHORTER, _REACH[0])
    for unit in units:
        vector, predicted_deg = posterior.with_drift(ensemble.center + ensemble.root @ unit, drift, scale_deg)
        if posterior.height(vector, predicted_deg, scale_deg) > height:
            chain = chain._replace(vector=vector, predicted_deg=predicted_deg)
            reach = min(chain.reach * _LONGER, _REACH[1])
            break
    information = model.information(move, scale_deg) + model.prior_information()
    covariance = ensemble.root @ np.linalg.inv(information)[:size, :size] @ ensemble.root.T
    scale_deg = posterior.readings.best_scale_deg(chain.predicted_deg, level.least_deg)
    return _Chain(
        chain.vector,
        chain.predicted_deg,
        _limited(reach * covariance),
        reach,
        posterior.height(chain.vector, chain.predicted_deg, scale_deg),
    )


def _with_covariance(posterior: Posterior, chains: list[_Chain], chance: np.random.Generator) -> Estimate:
    """Return the end of the highest chain with the covariance about it; other chains count by their heights."""
    best, *others = chains
    size, drift = posterior.size, best.vector[posterior.size :]
    scale_deg = posterior.readings.best_scale_deg(best.predicted_deg, LEVELS[-1].least_deg)
    coarse_deg = max(scale_deg, _CONFIDENCE_SCALE_DEG)
    covariance = best.covariance
    for members in _CONFIDENCE_MEMBERS:
        ensemble = drawn(posterior.predict, best.vector[:size], covariance, members, chance)
        model = _LinearPosterior.of(posterior, ensemble, drift)
        information, spurious = model.measured_information(coarse_deg)
        unrooted = np.linalg.inv(model.basis)
        information, spurious = (unrooted.T @ matrix @ unrooted for matrix in (information, spurious))
        whole: Array = np.linalg.inv(information + np.eye(len(best.vector))).astype(np.float64)
        whole = whole + whole @ spurious @ whole
        covariance = _limited(whole[:size, :size])
    for other in others:
        odds = np.exp(min(0.0, other.height - best.height) / _EQUAL_HEIGHT)
        apart = other.vector - best.vector
        whole = whole + odds / (1.0 + odds) * np.outer(apart, apart)
    return Estimate(best.vector, whole, information, best.height, scale_deg, best.predicted_deg)


def _limited(covariance: Array) -> Array:
    """Return a covariance that is nowhere wider than the first ensemble's."""
    information = np.linalg.inv(covariance) + _FIRST_SPREAD**-2.0 * np.eye(len(covariance))
    result: Array = np.linalg.inv((information + information.T) / 2.0)
    return result


class _LinearPosterior(NamedTuple):
    """The posterior with a linear model of the angles. A move shifts the constants by units, and the drift."""

    posterior: Posterior
    origin: Array
    basis: Array  # vector = origin + basis @ move
    still_deg: Array
    slopes: Array  # angles = still + slopes @ move
    residual: Array = np.empty((0, 0))  # (members, readings), what the linear model leaves out

    @classmethod
    def of(cls, posterior: Posterior, ensemble: Ensemble, drift: Array) -> "_LinearPosterior":
        linear = regressed(ensemble)
        return cls(
            posterior,
            np.concatenate([ensemble.center, drift]),
            block_diag(ensemble.root, np.eye(len(drift))),
            linear.mean + posterior.drift @ drift,
            np.hstack([linear.slopes, posterior.drift]),
            linear.residual,
        )

    def height(self, move: Array, scale_deg: float) -> float:
        return self.posterior.height(self.origin + self.basis @ move, self.still_deg + self.slopes @ move, scale_deg)

    def information(self, move: Array, scale_deg: float) -> Array:
        """Return the likelihood's negative Hessian."""
        _, weight = self.posterior.readings.derivatives(self.still_deg + self.slopes @ move, scale_deg)
        result: Array = self.slopes.T @ (self.slopes * weight[:, None])
        return result

    def measured_information(self, scale_deg: float) -> tuple[Array, Array]:
        """Return the likelihood's negative Hessian, and the variance of its slope by what the linear model leaves out.

        The residual also adds noise to the slopes of the linear model. The information that this noise seems to give
        is subtracted.
        """
        _, weight = self.posterior.readings.derivatives(self.still_deg, scale_deg)
        members, size = len(self.residual), self.posterior.size
        information = self.information(np.zeros(self.basis.shape[1]), scale_deg)
        variance = np.sum(self.residual**2, axis=0) / max(members - size - 1, 1)
        noise = float(np.sum(weight * variance)) / members
        noisy = np.zeros_like(information)
        noisy[:size, :size] = noise * np.eye(size)
        values, axes = np.linalg.eigh(information - noisy)
        former = np.einsum("ij,ik,kj->j", axes, information, axes)
        information = (axes * np.maximum(values, _LEAST_INFORMATION * former)) @ axes.T
        slopes = (self.residual * weight) @ self.slopes
        spurious: Array = slopes.T @ slopes / max(members - size - 1, 1)
        return information, spurious

    def prior_information(self) -> Array:
        result: Array = self.basis.T @ self.basis
        return result

    def maximum(self, scale_deg: float, reachable: Array, rounds: int, enough: float) -> Array:
        """Return the best move within bounds, by Newton's method with Levenberg's damping."""
        move, damping = np.zeros(self.basis.shape[1]), 1e-4
        height = self.height(move, scale_deg)
        for _ in range(rounds):
            slope, _ = self.posterior.readings.derivatives(self.still_deg + self.slopes @ move, scale_deg)
            rise = self.slopes.T @ slope - self.basis.T @ (self.origin + self.basis @ move)
            information = self.information(move, scale_deg) + self.prior_information()
            while damping < 1e5:
                damped = information + damping * np.diag(np.diag(information))
                candidate = np.clip(move + np.linalg.solve(damped, rise), -reachable, reachable)
                gain = self.height(candidate, scale_deg) - height
                if gain > 0.0:
                    break
                damping *= 6.0
            else:
                return move
            move, height, damping = candidate, height + gain, max(damping / 6.0, 1e-6)
            if gain < enough:
                return move
        return move
