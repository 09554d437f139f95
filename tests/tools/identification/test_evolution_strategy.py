from collections.abc import Callable

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.optimize import Bounds, differential_evolution, minimize
from scipy.stats import ortho_group

from tools.emulated import Array
from tools.identification.evolution_strategy import Summit, climb


def climbed(height: Callable[[Array], float], mean: Array, generations: int, seed: int = 1) -> Summit:
    return climb(height, mean, np.eye(len(mean)), 16, generations, np.random.default_rng(seed))


@pytest.mark.parametrize("seed", range(3))
def test_it_follows_a_ridge_that_runs_across_the_coordinates(seed: int) -> None:
    size = 6
    axes = ortho_group.rvs(size, random_state=seed)
    hessian = axes @ np.diag(np.geomspace(1.0, 1e4, size)) @ axes.T
    peak = np.arange(size) - 2.5

    summit = climbed(lambda vector: -float((vector - peak) @ hessian @ (vector - peak)), np.zeros(size), 250, seed)

    assert_allclose(summit.best, peak, atol=1e-3)
    along = np.linalg.eigh(summit.covariance)[1][:, -1]
    assert abs(along @ axes[:, 0]) > 0.95


def rugged(vector: Array) -> float:
    """Return Rastrigin's function, upside down: a wide hill that is covered with narrow ones."""
    return -float(np.sum((vector - 1.5) ** 2 + 2.0 * (1.0 - np.cos(2.0 * np.pi * (vector - 1.5)))))


def depth(vector: Array) -> float:
    return -rugged(vector)


def test_it_sees_past_the_narrow_peaks_at_which_newtons_method_stops() -> None:
    start = np.array([-2.7, 3.9, -1.2])
    stopped = minimize(depth, start, method="BFGS")
    highest = differential_evolution(depth, Bounds([-5.0] * 3, [5.0] * 3), seed=1)

    summit = climbed(rugged, start, 80)

    assert -stopped.fun < -2.0
    assert_allclose(rugged(summit.best), -highest.fun, atol=1e-3)
    assert_allclose(summit.best, highest.x, atol=0.02)


def test_the_same_chance_leads_to_the_same_summit() -> None:
    first, second = (climbed(rugged, np.zeros(3), 10) for _ in range(2))

    for one, other in zip(first, second, strict=True):
        assert_array_equal(one, other)
