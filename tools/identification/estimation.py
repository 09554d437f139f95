"""Estimation of the constants: the maximum of the posterior, by an iterated ensemble smoother.

The posterior has many narrow peaks on long ridges. Each round simulates an ensemble of constants, fits a linear model
to the simulated angles, and maximizes the posterior of that model. It moves there if the simulation confirms it. The
first rounds accept prediction errors of a hundredth of a degree, at which the peaks merge; the last rounds a fraction
of a count. Several chains start from different values of the backlash; the better ones continue at each level.

Method: Y. Chen and D. Oliver, "Levenberg-Marquardt forms of the iterative ensemble smoother", Computational Geosciences
17 (2013) 689-703; here with the likelihood of intervals instead of a normal one.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from tools.emulated import Array
from tools.identification.ensemble import drawn
from tools.identification.posterior import LinearPosterior, Posterior


class Level(NamedTuple):
    """A part of the search."""

    least_deg: float  # the scale
    rounds: int  # at most
    members: int  # of an ensemble
    survivors: int  # chains that continue afterwards
    enough: float = -np.inf  # the level ends once the heights rise by less within some rounds


COMMON_LEVEL = Level(2e-2, 5, 28, 1)
"""All chains together, before they are split."""

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
"""After the best chain has been split once more."""

_FORK = (-0.13, 0.13)
"""Change of the varied constant in the split, in standard units."""

_FIRST_SPREAD = 0.25
"""Standard deviation of the first ensemble, as a share of the prior's."""

_PATIENCE = 4
"""Number of rounds over which an increase is counted."""

_SAME_SHARE, _LEAST_CHAINS = 0.2, 2
"""Chains whose predictions differ by less than this share of the scale are on the same peak."""

_REACH = (0.25, 4.0)
"""Minimum and maximum covariance of an ensemble, as a share of the posterior's."""
_SHORTER, _LONGER = 0.3, 1.5
_TRUST = 2.0
"""Maximum length of a step, in standard deviations of the ensemble."""
_STEPS = (1.0, 0.5, 0.25)
_HALF_TRUST = 6.0
"""The same for one half of the readings."""

_FINE, _HOPELESS = 1.5, 30.0
"""If a search ends at a scale above this multiple of the finest one, it is repeated.

If the result is still above it, the recording is faulty.
"""
_MORE_MEMBERS = 0.5
"""Share by which the ensembles of the repetition are larger."""

_NEWTON_ROUNDS, _NEWTON_GAIN = 12, 0.05

_EQUAL_HEIGHT = 8.0
"""A peak that is lower by this is less likely by a factor e: the height of a narrow peak is partly random."""

_CONFIDENCE_SCALE_DEG = 1.5e-3
"""The covariance assumes no reading to be more accurate than this: finer detail belongs to one of many narrow peaks."""
_CONFIDENCE_SHARE = 5.0
"""Also not more accurate than this multiple of the scale at which the best peak explains the readings."""
_NEGLIGIBLE = 1e-9
_CONFIDENCE_MEMBERS = (60, 60, 120)


class Half(NamedTuple):
    """The result for one half of the readings, near the common peak, with the covariance of likelihood and prior."""

    vector: Array
    covariance: Array


class Estimate(NamedTuple):
    """A peak of the posterior, in standard units."""

    vector: Array
    covariance: Array
    halves: tuple[Half, Half]
    log_posterior: float
    scale_deg: float  # of the prediction error
    predicted_deg: Array


class _Chain(NamedTuple):
    """A search: its position, and the distribution of its next ensemble."""

    vector: Array
    predicted_deg: Array
    covariance: Array  # of the constants
    reach: float
    height: float  # at the best scale of its level


def estimate(
    posterior: Posterior, forked: int, values: list[float], progress: Callable[[float], None] = lambda _: None
) -> Estimate:
    """Return the highest peak found, with a covariance that includes other peaks of similar height.

    Args:
        posterior: the problem.
        forked: index of the constant in which the chains differ at first.
        values: its value in each chain.
        progress: called with the finished share.
    """
    chance, chains = np.random.default_rng(0), _search(posterior, forked, values, 0, progress)
    least_deg = FINE_LEVELS[-1].least_deg
    scale_deg = posterior.readings.best_scale_deg(chains[0].predicted_deg, least_deg)
    if _FINE * least_deg < scale_deg < _HOPELESS * least_deg:
        again = _search(posterior, forked, values, 1, progress)
        chains = max(chains, again, key=lambda found: found[0].height)
    return _with_covariance(posterior, chains, chance)


def _search(
    posterior: Posterior, forked: int, values: list[float], repetition: int, progress: Callable[[float], None]
) -> list[_Chain]:
    """Return the ends of the best chains.

    Args:
        posterior: the problem.
        forked: index of the constant in which the chains differ at first.
        values: its value in each chain.
        repetition: 0 for the first search, 1 for the second, which has larger and other ensembles.
        progress: called with the finished share.
    """
    chance, members = np.random.default_rng(repetition), (1.0 + _MORE_MEMBERS * repetition)
    levels = (COMMON_LEVEL, *LEVELS, *FINE_LEVELS)
    origin, first = np.zeros(posterior.size + posterior.drift.shape[1]), _FIRST_SPREAD**2 * np.eye(posterior.size)
    chains = [_Chain(origin, np.empty(0), first, _REACH[1], -np.inf)]
    for done, level in enumerate(levels):
        if level is LEVELS[0]:
            chains = [_forked(chains[0], first, forked, value) for value in values]
        if level is FINE_LEVELS[0]:
            best = chains[0]
            chains += [_forked(best, best.covariance, forked, best.vector[forked] + shift) for shift in _FORK]
        heights = [-np.inf] * _PATIENCE
        larger = level._replace(members=2 * round(members * level.members / 2.0))
        for turn in range(level.rounds):
            chains = [_advanced(posterior, chain, larger, chance) for chain in chains]
            progress((done + (turn + 1) / level.rounds) / len(levels))
            heights.append(max(chain.height for chain in chains))
            if heights[-1] - heights[-1 - _PATIENCE] < level.enough:
                break
        chains = _survivors(chains, level)
    return chains


def _survivors(chains: list[_Chain], level: Level) -> list[_Chain]:
    """Return the highest chains. Of chains with the same predictions only one is kept, but at least two chains."""
    first, *others = sorted(chains, key=lambda chain: -chain.height)
    kept: list[_Chain] = [first]
    copies: list[_Chain] = []
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
    """Return a chain after one round: ensemble, linear model, step, and the distribution of the next ensemble."""
    size, drift = posterior.size, chain.vector[posterior.size :]
    ensemble = drawn(posterior.predict, chain.vector[:size], chain.covariance, level.members, chance)
    model = LinearPosterior.of(posterior, ensemble, drift)
    scale_deg = posterior.readings.best_scale_deg(model.still_deg, level.least_deg)
    reachable = np.array([_TRUST] * size + [np.inf] * len(drift))
    rough_deg = np.hypot(scale_deg, model.unexplained_deg())  # the linear model's error is part of the prediction's
    move = model.maximum(rough_deg, reachable, _NEWTON_ROUNDS, _NEWTON_GAIN)

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
    information = model.information(move, rough_deg) + model.prior_information()
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
    """Return the end of the highest chain with its covariance; other chains are weighted by their heights.

    The part that the linear model omits is a model error. It adds to the variance of the likelihood's slope. So its
    information is Godambe's, H (H + S)^-1 H, with the negative Hessian H and that variance S.
    """
    best, *others = chains
    size, drift = posterior.size, best.vector[posterior.size :]
    scale_deg = posterior.readings.best_scale_deg(best.predicted_deg, FINE_LEVELS[-1].least_deg)
    coarse_deg = max(_CONFIDENCE_SHARE * scale_deg, _CONFIDENCE_SCALE_DEG)
    covariance = best.covariance
    for members in _CONFIDENCE_MEMBERS:
        ensemble = drawn(posterior.predict, best.vector[:size], covariance, members, chance)
        model = LinearPosterior.of(posterior, ensemble, drift)
        information, spurious = model.measured_information(coarse_deg)
        unrooted = np.linalg.inv(model.basis)
        information, spurious = (unrooted.T @ matrix @ unrooted for matrix in (information, spurious))
        prior = np.eye(len(best.vector))
        covariance = _limited(np.linalg.inv(information + prior)[:size, :size].astype(np.float64))
        robust = information @ np.linalg.solve(information + spurious + _NEGLIGIBLE * prior, information)
        whole: Array = np.linalg.inv((robust + robust.T) / 2.0 + prior).astype(np.float64)
    middle = len(best.predicted_deg) // 2
    halves = (
        _half(model.part(slice(None, middle)), scale_deg),
        _half(model.part(slice(middle, None)), scale_deg),
    )
    for other in others:
        odds = np.exp(min(0.0, other.height - best.height) / _EQUAL_HEIGHT)
        apart = other.vector - best.vector
        whole = whole + odds / (1.0 + odds) * np.outer(apart, apart)
    return Estimate(best.vector, whole, halves, best.height, scale_deg, best.predicted_deg)


def _half(model: LinearPosterior, scale_deg: float) -> Half:
    size = model.posterior.size
    reachable = np.array([_HALF_TRUST] * size + [np.inf] * (model.basis.shape[1] - size))
    move = model.maximum(scale_deg, reachable, _NEWTON_ROUNDS, _NEWTON_GAIN)
    information, _ = model.measured_information(scale_deg)
    covariance = np.linalg.inv(information + model.prior_information())
    return Half(model.origin + model.basis @ move, model.basis @ covariance @ model.basis.T)


def _limited(covariance: Array) -> Array:
    """Return a covariance that is nowhere wider than the first ensemble's."""
    information = np.linalg.inv(covariance) + _FIRST_SPREAD**-2.0 * np.eye(len(covariance))
    return np.linalg.inv((information + information.T) / 2.0).astype(np.float64)
