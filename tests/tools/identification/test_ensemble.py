import numpy as np
from numpy.testing import assert_allclose

from tools.emulated import Array
from tools.identification.ensemble import drawn, regressed

_SLOPES = np.array([[2.0, -1.0], [0.5, 3.0], [0.0, 1.0]])
_CENTER = np.array([0.3, -0.2])
_COVARIANCE = np.array([[0.04, 0.018], [0.018, 0.01]])


def line(point: Array) -> Array:
    result: Array = _SLOPES @ point + 1.0
    return result


def test_the_points_have_the_asked_mean_and_covariance() -> None:
    ensemble = drawn(line, _CENTER, _COVARIANCE, 4000, np.random.default_rng(1))

    points = ensemble.center + ensemble.units @ ensemble.root.T
    assert_allclose(points.mean(axis=0), _CENTER, atol=1e-12)  # each has its mirror image
    assert_allclose(np.cov(points.T), _COVARIANCE, rtol=0.1)


def test_a_linear_function_is_found_with_nothing_left() -> None:
    ensemble = drawn(line, _CENTER, _COVARIANCE, 200, np.random.default_rng(1))

    linear = regressed(ensemble)

    assert_allclose(linear.mean, line(_CENTER), atol=1e-12)
    assert_allclose(linear.slopes, _SLOPES @ ensemble.root, rtol=1e-3, atol=1e-4)
    assert np.abs(linear.residual).max() < 1e-3


def test_ruggedness_is_averaged_out_of_the_slopes_and_stays_in_the_residual() -> None:
    def rugged(point: Array) -> Array:
        result: Array = line(point) + 0.05 * np.sin(1e4 * point.sum())
        return result

    ensemble = drawn(rugged, _CENTER, _COVARIANCE, 400, np.random.default_rng(1))

    linear = regressed(ensemble)

    assert_allclose(linear.slopes, _SLOPES @ ensemble.root, atol=0.01)
    assert_allclose(linear.residual.std(), 0.05 / np.sqrt(2.0), rtol=0.1)
