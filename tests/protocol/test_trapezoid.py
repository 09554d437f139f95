"""The kit's model of a motion is held to Ruckig's, and to what is true of any."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from ruckig import InputParameter, Result, Ruckig, Trajectory

from protocol.trapezoid import plan

positions = st.floats(-400, 400)
speeds = st.floats(-40, 40)
tops = st.floats(0.5, 40)
rates = st.floats(1, 100)


@settings(max_examples=200, deadline=None)
@given(start=positions, target=positions, top=tops, rate=rates, share=st.floats(-1, 1))
def test_within_its_top_speed_a_motion_is_the_fastest_one(
    start: float, target: float, top: float, rate: float, share: float
) -> None:
    motion = plan(start, share * top, target, top, rate)
    wanted = InputParameter(1)
    wanted.current_position, wanted.current_velocity, wanted.current_acceleration = [start], [share * top], [0.0]
    wanted.target_position, wanted.target_velocity, wanted.target_acceleration = [target], [0.0], [0.0]
    wanted.max_velocity, wanted.max_acceleration, wanted.max_jerk = [top], [rate], [math.inf]
    oracle = Trajectory(1)
    assert Ruckig(1).calculate(wanted, oracle) in {Result.Working, Result.Finished}
    assert motion.duration_s == pytest.approx(oracle.duration, rel=1e-6, abs=1e-6)
    for share_of_time in (0.1, 0.3, 0.5, 0.7, 0.9):
        time_s = share_of_time * oracle.duration
        assert motion.at(time_s)[0] == pytest.approx(oracle.at_time(time_s)[0][0], rel=1e-6, abs=1e-5)


@settings(max_examples=200, deadline=None)
@given(start=positions, speed=speeds, target=positions, top=tops, rate=rates)
def test_any_motion_begins_where_it_is_ends_at_its_target_and_never_steps(
    start: float, speed: float, target: float, top: float, rate: float
) -> None:
    motion = plan(start, speed, target, top, rate)
    assert motion.at(0.0) == (start, speed)
    last = motion.duration_s * (1 - 1e-12)
    assert motion.at(last)[0] == pytest.approx(target, abs=1e-6)
    assert motion.at(last)[1] == pytest.approx(0.0, abs=1e-3)
    step_s = motion.duration_s / 100
    for index in range(100):
        before, after = motion.at(index * step_s), motion.at((index + 1) * step_s)
        assert abs(after[1] - before[1]) <= rate * step_s + 1e-3
        assert abs(after[1]) <= max(top, abs(speed)) + 1e-9


def test_a_motion_faster_than_its_new_top_speed_decelerates_at_a() -> None:
    motion = plan(0.0, 20.0, 100.0, 10.0, 5.0)
    assert motion.phases[0] == (2.0, -5.0)
    assert motion.at(2.0) == (30.0, 10.0)


def test_no_way_takes_no_time() -> None:
    assert plan(3.0, 0.0, 3.0, 10.0, 10.0).duration_s == 0.0
