import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from planner.table.motion import (
    limited_acceleration,
    motion_through_angles,
    next_angle,
    next_speed,
    roll_out,
    swept_angles,
)

ANGLES = st.floats(-500.0, 500.0)
SPEEDS = st.floats(-40.0, 40.0)
ACCELERATIONS = st.floats(-100.0, 100.0)
STEPS = st.floats(0.01, 2.0)


@settings(max_examples=20, deadline=None)
@given(ANGLES, SPEEDS, ACCELERATIONS, STEPS)
def test_equations_3_and_4_are_what_integrating_the_acceleration_gives(
    angle: float, speed: float, acceleration: float, step_s: float
) -> None:
    motion = solve_ivp(lambda _, state: [state[1], acceleration], (0.0, step_s), [angle, speed], rtol=1e-10, atol=1e-10)
    assert next_angle(angle, speed, acceleration, step_s) == pytest.approx(motion.y[0, -1], abs=1e-6)
    assert next_speed(speed, acceleration, step_s) == pytest.approx(motion.y[1, -1], abs=1e-6)


@settings(max_examples=100, deadline=None)
@given(ANGLES, SPEEDS, ACCELERATIONS, STEPS)
def test_the_swept_angles_are_the_extremes_of_the_way(
    angle: float, speed: float, acceleration: float, step_s: float
) -> None:
    t = np.linspace(0.0, step_s, 2001)
    way = angle + speed * t + 0.5 * acceleration * t**2
    assert swept_angles(angle, speed, acceleration, step_s) == pytest.approx((way.min(), way.max()), abs=1e-3)


@settings(max_examples=100, deadline=None)
@given(SPEEDS, ACCELERATIONS, STEPS)
def test_a_limited_acceleration_keeps_the_speed_and_never_grows(
    speed: float, acceleration: float, step_s: float
) -> None:
    limited = limited_acceleration(speed, acceleration, step_s, 40.0)
    assert abs(next_speed(speed, limited, step_s)) <= 40.0 + 1e-9
    assert abs(limited) <= abs(acceleration) + 1e-9
    if abs(next_speed(speed, acceleration, step_s)) <= 40.0:
        assert limited == acceleration


@settings(max_examples=30, deadline=None)
@given(ANGLES, SPEEDS, st.lists(ACCELERATIONS, min_size=1, max_size=20), STEPS)
def test_the_motion_through_the_angles_of_a_motion_is_that_motion(
    angle: float, speed: float, accelerations: list[float], step_s: float
) -> None:
    angles, speeds = roll_out(angle, speed, np.array(accelerations), step_s)
    found_speeds, found_accelerations = motion_through_angles(angles, speed, step_s)
    assert found_speeds == pytest.approx(speeds, abs=1e-6)
    assert found_accelerations == pytest.approx(np.array(accelerations), abs=1e-3)
