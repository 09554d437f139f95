"""The search on problems whose answers are known."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tools.emulated import Array
from tools.identification.estimation import Estimate, estimate
from tools.identification.likelihood import Intervals
from tools.identification.posterior import Posterior

_TIME = np.linspace(0.0, 1.0, 600)
_GRID_DEG = 0.02
_NO_DRIFT = np.empty((len(_TIME), 0))


def swing(vector: Array) -> Array:
    """A swing whose width, rate and offset are exponentials, as a table's constants are."""
    width, rate, offset = vector
    result: Array = np.exp(0.3 * width) * np.sin(20.0 * np.exp(0.1 * rate) * _TIME) + 0.1 * offset
    return result


def two_sided(vector: Array) -> Array:
    """The same width with either sign of the rate, except for a small term that only one of them has."""
    width, rate, offset = vector
    result: Array = swing(np.array([width, abs(rate), offset])) + 0.004 * max(rate, 0.0) * np.cos(7.0 * _TIME)
    return result


def rugged(vector: Array) -> Array:
    result: Array = swing(vector) + 0.002 * np.sin(3000.0 * vector.sum() + 50.0 * _TIME)
    return result


def read(angle_deg: Array) -> Intervals:
    low = np.floor(angle_deg / _GRID_DEG) * _GRID_DEG
    return Intervals(low, low + _GRID_DEG)


def found(problem: Posterior) -> Estimate:
    return estimate(problem, forked=1, values=[-1.0, 0.0, 1.0])


@pytest.mark.parametrize("truth", [(0.7, -1.4, 0.4), (-1.8, 1.1, -2.0)])
@pytest.mark.parametrize("predict", [swing, rugged])
def test_the_truth_is_found_within_the_interval(predict: object, truth: tuple[float, float, float]) -> None:
    assert callable(predict)
    vector = np.array(truth)

    estimated = found(Posterior(read(predict(vector)), predict, _NO_DRIFT, 3))

    deviation = np.sqrt(np.diag(estimated.covariance))
    assert_allclose(estimated.vector, vector, atol=0.02)
    assert (np.abs(estimated.vector - vector) < 3.0 * deviation).all()
    assert deviation.max() < 0.05


def test_the_higher_of_two_peaks_is_taken() -> None:
    vector = np.array([0.5, -1.2, 0.3])

    estimated = found(Posterior(read(two_sided(vector)), two_sided, _NO_DRIFT, 3))

    assert_allclose(estimated.vector, vector, atol=0.02)


def test_what_the_readings_do_not_show_keeps_the_priors_width() -> None:
    def blind(vector: Array) -> Array:
        return swing(np.array([vector[0], vector[1], 0.3]))

    estimated = found(Posterior(read(blind(np.zeros(3))), blind, _NO_DRIFT, 3))

    assert_allclose(np.sqrt(estimated.covariance[2, 2]), 1.0, rtol=0.05)


def test_a_drift_is_estimated_beside_the_constants() -> None:
    vector, slope = np.array([0.4, 0.6, -0.5]), 0.05 * _TIME

    estimated = found(Posterior(read(swing(vector) + slope), swing, 0.05 * _TIME[:, None], 3))

    assert_allclose(estimated.vector, [*vector, 1.0], atol=0.05)


def test_a_model_that_explains_the_readings_badly_widens_the_interval() -> None:
    vector = np.array([0.4, 0.6, -0.5])
    good = Posterior(read(swing(vector)), swing, _NO_DRIFT, 3)
    bad = Posterior(read(swing(vector) + 0.05 * np.sin(90.0 * _TIME)), swing, _NO_DRIFT, 3)

    widths = [np.sqrt(np.diag(found(problem).covariance)) for problem in (good, bad)]

    assert (widths[1] > 3.0 * widths[0]).all()


def test_a_search_that_leaves_a_little_unexplained_is_repeated() -> None:
    def simulations(disturbance_deg: float) -> int:
        made: list[Array] = []

        def counted(vector: Array) -> Array:
            made.append(vector)
            return swing(vector)

        found(Posterior(read(swing(np.zeros(3)) + disturbance_deg * np.sin(90.0 * _TIME)), counted, _NO_DRIFT, 3))
        return len(made)

    once = simulations(0.0)
    assert simulations(0.004) > 1.7 * once
    assert simulations(0.2) < 1.3 * once  # a faulty recording: no search helps
