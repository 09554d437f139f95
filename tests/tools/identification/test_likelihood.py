import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from tools.identification.likelihood import Intervals

angles = st.floats(-1.0, 1.0)
scales = st.floats(0.01, 0.3)


@given(angles, scales)
@settings(max_examples=30)
def test_all_readings_together_have_probability_one(angle_deg: float, scale_deg: float) -> None:
    edges = np.arange(-20.0, 20.0, 0.1)
    readings = (Intervals(np.array([low]), np.array([low + 0.1])) for low in edges)

    total = sum(np.exp(reading.log_likelihood(np.array([angle_deg]), scale_deg)) for reading in readings)

    assert_allclose(total, 1.0, rtol=1e-6)


@given(angles, scales)
@settings(max_examples=30)
def test_slope_and_curvature_are_the_derivatives(angle_deg: float, scale_deg: float) -> None:
    reading = Intervals(np.array([0.05]), np.array([0.15]))
    step = 1e-4

    def log(shift: float) -> float:
        return reading.log_likelihood(np.array([angle_deg + shift]), scale_deg)

    at = np.array([angle_deg])
    slope, curvature = reading.derivatives(at, scale_deg)
    assert_allclose(slope, (log(step) - log(-step)) / (2 * step), rtol=1e-3, atol=1e-3)
    assert_allclose(curvature, -(log(step) - 2 * log(0.0) + log(-step)) / step**2, rtol=1e-2, atol=1e-2)
