"""A rough function of several variables as a linear one: regression over an ensemble.

Counts are integers, and teeth are either in contact or not, so the simulated angles are a rough function of the
constants. A derivative by small differences is mostly noise. The regression over many points averages this.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from tools.emulated import Array

_RIDGE = 1e-2
"""Regularization of the regression, small compared with the number of members."""

_LEAST_VARIANCE = 1e-10


class Ensemble(NamedTuple):
    """The function at points that are normally distributed around a center.

    Units: a point is `center + root @ unit`, so units are standard normal.
    """

    center: Array  # (n,)
    root: Array  # (n, n), a square root of the covariance
    units: Array  # (members, n)
    values: Array  # (members, readings)


class Linear(NamedTuple):
    """The regression: value = mean + slopes @ unit."""

    mean: Array  # (readings,)
    slopes: Array  # (readings, n)
    residual: Array  # (members, readings)


def drawn(
    function: Callable[[Array], Array], center: Array, covariance: Array, members: int, chance: np.random.Generator
) -> Ensemble:
    """Evaluate a function at points around a center; each point has its mirror image.

    Args:
        function: from (n,) to (readings,).
        center: (n,), the mean of the points.
        covariance: (n, n), of the points.
        members: number of points, even.
        chance: random generator.
    """
    half = chance.standard_normal((members // 2, len(center)))
    units = np.vstack([half, -half])
    variances, axes = np.linalg.eigh((covariance + covariance.T) / 2.0)
    root = axes * np.sqrt(np.maximum(variances, _LEAST_VARIANCE))
    return Ensemble(center, root, units, np.array([function(center + root @ unit) for unit in units]))


def regressed(ensemble: Ensemble) -> Linear:
    """Return the linear regression of the values on the units."""
    members, size = ensemble.units.shape
    design = np.hstack([np.ones((members, 1)), ensemble.units])
    ridge = np.diag([0.0, *[_RIDGE] * size])
    coefficients = np.linalg.solve(design.T @ design + ridge, design.T @ ensemble.values)
    return Linear(coefficients[0], coefficients[1:].T, ensemble.values - design @ coefficients)
