"""Score tests of a least-squares fit: whether the residuals show a change of a parameter during the measurement.

The residuals are in groups (views, table angles) in the order of the measurements. A change multiplies the derivatives
of some parameters by a weight for each group: 0 then 1 for a step, a straight line for a drift, 1 in one group for an
outlier. The score statistic (Rao 1948; also called Lagrange multiplier test) needs only the fit without the change. It
is chi-square distributed, or F distributed if the noise is estimated from the same residuals.
"""

from typing import NamedTuple, Self

import numpy as np
from scipy import stats

from planner.arrays import FloatArray, IndexArray

FALSE_ALARMS = 1e-3
"""Probability that all tests of one calibration together refuse valid data."""
# Directions that the other parameters explain up to this share contain no information about a change.
_EXPLAINED = 1e-9


class NormalEquations(NamedTuple):
    """The normal equations of a fit, one summand per group; residuals are in units of their standard deviation.

    Attributes:
        matrix: `(n, p, p)` sum of J^T J over the group's residuals.
        gradient: `(n, p)` sum of J^T r.
        chi_square: sum of all squared residuals.
        freedom: degrees of freedom: residuals minus parameters.
    """

    matrix: FloatArray
    gradient: FloatArray
    chi_square: float
    freedom: int

    @classmethod
    def of(cls, residuals: FloatArray, jacobian: FloatArray, groups: IndexArray) -> Self:
        """Return them for residuals `(m,)`, Jacobian `(m, p)` and each residual's group `(m,)`, ascending from 0."""
        starts = np.searchsorted(groups, np.arange(groups[-1] + 1))
        ends = np.append(starts[1:], len(groups))
        parts = [(jacobian[a:b], residuals[a:b]) for a, b in zip(starts, ends, strict=True)]
        return cls(
            np.array([J.T @ J for J, _ in parts]),
            np.array([J.T @ r for J, r in parts]),
            float(residuals @ residuals),
            len(residuals) - jacobian.shape[1],
        )


class Change(NamedTuple):
    """The change with the highest significance in a series of groups.

    Attributes:
        kind: "drift", "step" or "outlier".
        group: the first group after the step, or the outlier; 0 for a drift.
        statistic: decrease of chi-square by the change.
        p_value: probability of such a large statistic without a change.
    """

    kind: str
    group: int
    statistic: float
    p_value: float


def find_change(fit: NormalEquations, parameters: slice, false_alarms: float, noise_is_known: bool) -> Change | None:
    """Return the change of some parameters that the residuals show, or None.

    Args:
        fit: the fit without a change.
        parameters: the parameters that may change.
        false_alarms: probability of a detected change in valid data (Bonferroni over all tests).
        noise_is_known: whether the unit of the residuals is their true standard deviation.
    """
    count = len(fit.matrix)
    places = np.arange(count)
    weights = np.concatenate(
        (places[np.newaxis] - places.mean(), places >= places[1:, np.newaxis], np.eye(count)), dtype=np.float64
    )
    names = [("drift", 0), *(("step", k) for k in range(1, count)), *(("outlier", k) for k in range(count))]
    statistics, ranks = _scores(fit, parameters, weights)
    p_values = _p_values(fit, statistics, ranks, noise_is_known)
    # For extreme values, all p-values are 0: then the maximum statistic is used.
    worst = int(np.lexsort((-statistics, p_values))[0])
    if p_values[worst] * len(weights) >= false_alarms:
        return None
    return Change(*names[worst], float(statistics[worst]), float(p_values[worst]))


def _scores(fit: NormalEquations, parameters: slice, weights: FloatArray) -> tuple[FloatArray, IndexArray]:
    """Return the score statistic and its rank for each row of weights `(m, n)`."""
    information = fit.matrix.sum(axis=0)
    scale = 1.0 / np.sqrt(np.maximum(np.diag(information), 1e-300))
    inverse = np.linalg.pinv(information * scale * scale[:, np.newaxis], rcond=1e-13, hermitian=True)
    matrix, gradient = fit.matrix * scale * scale[:, np.newaxis], fit.gradient * scale
    mixed = np.tensordot(weights, matrix[:, parameters, :], 1)
    own = np.tensordot(weights**2, matrix[:, parameters, parameters], 1)
    left = own - mixed @ inverse @ np.swapaxes(mixed, 1, 2)
    slope = weights @ gradient[:, parameters] - mixed @ inverse @ gradient.sum(axis=0)
    values, vectors = np.linalg.eigh(left)
    informative = values > _EXPLAINED * np.trace(own, axis1=1, axis2=2)[:, np.newaxis]
    along = np.einsum("mij,mi->mj", vectors, slope)
    parts = np.divide(along**2, values, out=np.zeros_like(along), where=informative)
    return parts.sum(axis=1), informative.sum(axis=1)


def _p_values(fit: NormalEquations, statistics: FloatArray, ranks: IndexArray, noise_is_known: bool) -> FloatArray:
    if noise_is_known:
        return np.where(ranks > 0, stats.chi2.sf(statistics, np.maximum(ranks, 1)), 1.0)
    left = fit.freedom - ranks
    testable = (ranks > 0) & (left > 0)
    ratios = np.divide(
        statistics * left, np.maximum(fit.chi_square - statistics, 1e-12 * fit.chi_square) * np.maximum(ranks, 1),
        out=np.zeros_like(statistics), where=testable & (fit.chi_square > 0.0),
    )  # fmt: skip
    return np.where(testable, stats.f.sf(ratios, np.maximum(ranks, 1), np.maximum(left, 1)), 1.0)
