"""The posterior of the constants, and an approximation with a linear model of the angles, which has a maximum."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag

from tools.emulated import Array
from tools.identification.ensemble import Ensemble, regressed
from tools.identification.likelihood import Intervals, Scale

Predict = Callable[[Array], Array]
"""Returns the expected angles (deg) of the readings, for a vector of constants, without the drift."""

_DRIFT_ROUNDS, _DRIFT_GAIN = 6, 0.01

_LEAST_INFORMATION = 0.05
"""Minimum share of an information that remains after noise is subtracted from it."""


class Posterior(NamedTuple):
    """The problem: readings and model.

    A vector contains the constants, then the coefficients of the drift, both in standard units. A priori each component
    is normally distributed with mean 0 and standard deviation 1.
    """

    readings: Intervals
    predict: Predict
    drift: Array  # (readings, coefficients)
    size: int  # number of constants

    def height(self, vector: Array, predicted_deg: Array, scale_deg: Scale) -> float:
        """Return the logarithm of the posterior."""
        return self.readings.log_likelihood(predicted_deg, scale_deg) - 0.5 * float(vector @ vector)

    def with_drift(self, constants: Array, drift: Array, scale_deg: float) -> tuple[Array, Array]:
        """Return the vector with the most likely drift, by Newton's method from a nearby drift, and its angles."""
        basis = np.vstack([np.zeros((self.size, len(drift))), np.eye(len(drift))])
        model = LinearPosterior(
            self, np.concatenate([constants, drift]), basis, self.predict(constants) + self.drift @ drift, self.drift
        )
        move = model.maximum(scale_deg, np.full(len(drift), np.inf), _DRIFT_ROUNDS, _DRIFT_GAIN)
        return model.origin + basis @ move, model.still_deg + self.drift @ move


class LinearPosterior(NamedTuple):
    """The posterior with a linear model of the angles. A move shifts the constants by units, and the drift."""

    posterior: Posterior
    origin: Array
    basis: Array  # vector = origin + basis @ move
    still_deg: Array
    slopes: Array  # angles = still + slopes @ move
    residual: Array = np.empty((0, 0))  # (members, readings), the part that the linear model omits

    @classmethod
    def of(cls, posterior: Posterior, ensemble: Ensemble, drift: Array) -> "LinearPosterior":
        """Return the posterior around the center of an ensemble and a drift."""
        linear = regressed(ensemble)
        return cls(
            posterior,
            np.concatenate([ensemble.center, drift]),
            block_diag(ensemble.root, np.eye(len(drift))),
            linear.mean + posterior.drift @ drift,
            np.hstack([linear.slopes, posterior.drift]),
            linear.residual,
        )

    def height(self, move: Array, scale_deg: Scale) -> float:
        """Return the logarithm of the posterior after a move."""
        return self.posterior.height(self.origin + self.basis @ move, self.still_deg + self.slopes @ move, scale_deg)

    def unexplained_deg(self) -> Array:
        """Return the standard deviation (readings,) of the part that the linear model omits."""
        members, size = len(self.residual), self.posterior.size
        result: Array = np.sqrt(np.sum(self.residual**2, axis=0) / max(members - size - 1, 1))
        return result

    def part(self, rows: slice) -> "LinearPosterior":
        """Return the same for some of the readings only."""
        whole = self.posterior
        part = whole._replace(readings=whole.readings.part(rows), drift=whole.drift[rows])
        return self._replace(
            posterior=part,
            still_deg=self.still_deg[rows],
            slopes=self.slopes[rows],
            residual=self.residual[:, rows],
        )

    def information(self, move: Array, scale_deg: Scale) -> Array:
        """Return the likelihood's negative Hessian."""
        _, weight = self.posterior.readings.derivatives(self.still_deg + self.slopes @ move, scale_deg)
        result: Array = self.slopes.T @ (self.slopes * weight[:, None])
        return result

    def measured_information(self, scale_deg: float) -> tuple[Array, Array]:
        """Return the likelihood's negative Hessian, and the variance of its slope by the omitted part.

        The residual also adds noise to the slopes of the linear model. The apparent information of this noise is
        subtracted.
        """
        _, weight = self.posterior.readings.derivatives(self.still_deg, scale_deg)
        members, size = len(self.residual), self.posterior.size
        information = self.information(np.zeros(self.basis.shape[1]), scale_deg)
        noise = float(np.sum(weight * self.unexplained_deg() ** 2)) / members
        noisy = np.zeros_like(information)
        noisy[:size, :size] = noise * np.eye(size)
        values, axes = np.linalg.eigh(information - noisy)
        former = np.einsum("ij,ik,kj->j", axes, information, axes)
        information = (axes * np.maximum(values, _LEAST_INFORMATION * former)) @ axes.T
        slopes = (self.residual * weight) @ self.slopes
        spurious: Array = slopes.T @ slopes / max(members - size - 1, 1)
        return information, spurious

    def prior_information(self) -> Array:
        """Return the prior's negative Hessian."""
        result: Array = self.basis.T @ self.basis
        return result

    def maximum(self, scale_deg: Scale, reachable: Array, rounds: int, enough: float) -> Array:
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
