"""The profile compared with the firmware's own, tick by tick, and with Ruckig's time-optimal one."""

import itertools
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from ruckig import InputParameter, Result, Ruckig, Trajectory

from emulator import Table, load_config
from protocol.trapezoid import (
    Motion,
    MotionCommand,
    ReferenceState,
    advance,
    segments,
    time_to_rest_s,
    way_to_rest_deg,
)

tenths = st.integers(1, 400).map(lambda n: n / 10)
commands = st.builds(
    MotionCommand,
    st.integers(-600, 600).map(lambda n: n / 10),
    tenths,
    st.integers(5, 1000).map(lambda n: n / 10),
)
states = st.builds(ReferenceState, st.floats(-50.0, 50.0), st.floats(-40.0, 40.0))


@given(st.lists(st.tuples(commands, st.integers(1, 1500)), min_size=1, max_size=4))
@settings(max_examples=25, deadline=None)
def test_it_predicts_the_reference_of_the_emulator_through_any_pre_emptions(
    motions: list[tuple[MotionCommand, int]],
) -> None:
    table = Table(load_config().with_serial(baud=0))
    state = ReferenceState(table.status().reference_deg, 0.0)
    for command, ticks in motions:
        target, speed, acceleration = command
        table.receive(f"A {acceleration}\rS {speed}\rP {target}\r".encode())
        table.advance(ticks)
        state = advance(state, command, ticks / 1000.0)
        status = table.status()
        assert status.reference_deg == pytest.approx(state.angle_deg, abs=1e-3)
        # Which tick a ramp ends in is open by one.
        assert status.reference_speed_deg_s == pytest.approx(state.speed_deg_s, abs=1e-3 * acceleration + 1e-2)


@given(states, commands, st.sampled_from([1.0, -1.0]), st.floats(0.0, 200.0))
@settings(max_examples=100, deadline=None)
def test_a_target_that_is_infinitely_far_is_like_one_beyond_every_braking_way(
    state: ReferenceState, command: MotionCommand, forward: float, duration_s: float
) -> None:
    far, farthest = (command._replace(target_deg=forward * angle) for angle in (1e5, math.inf))
    there = advance(state, far, duration_s)
    assert tuple(advance(state, farthest, duration_s)) == pytest.approx(tuple(there), abs=1e-6)


@given(states, commands)
@settings(max_examples=100, deadline=None)
def test_it_takes_the_shortest_time_that_there_is(state: ReferenceState, command: MotionCommand) -> None:
    if abs(state.speed_deg_s) > command.speed_deg_s:
        return  # Ruckig first brakes at the limit; the controller does so too, but Ruckig calls such a start invalid
    asked = InputParameter(1)
    asked.current_position, asked.current_velocity = [state.angle_deg], [state.speed_deg_s]
    asked.target_position = [command.target_deg]
    asked.max_velocity, asked.max_acceleration = [command.speed_deg_s], [command.acceleration_deg_s2]
    asked.max_jerk = [float("inf")]
    trajectory = Trajectory(1)
    assert Ruckig(1).calculate(asked, trajectory) == Result.Working
    assert time_to_rest_s(state, command) == pytest.approx(trajectory.duration, abs=1e-6)
    for share in (0.1, 0.35, 0.5, 0.8):
        position, velocity, _ = trajectory.at_time(share * trajectory.duration)
        there = advance(state, command, share * trajectory.duration)
        assert there.angle_deg == pytest.approx(position[0], abs=1e-5)
        assert there.speed_deg_s == pytest.approx(velocity[0], abs=1e-4)


@given(states, commands, st.floats(0.0, 3.0), st.floats(0.0, 3.0))
@settings(max_examples=100, deadline=None)
def test_a_profile_can_be_cut_anywhere(
    state: ReferenceState, command: MotionCommand, first_s: float, second_s: float
) -> None:
    whole = advance(state, command, first_s + second_s)
    halves = advance(advance(state, command, first_s), command, second_s)
    assert halves.angle_deg == pytest.approx(whole.angle_deg, abs=1e-6)
    assert halves.speed_deg_s == pytest.approx(whole.speed_deg_s, abs=1e-3)


@given(states, commands)
@settings(max_examples=60, deadline=None)
def test_the_way_to_rest_holds_every_angle_on_it(state: ReferenceState, command: MotionCommand) -> None:
    lowest, highest = way_to_rest_deg(state, command)
    end_s = time_to_rest_s(state, command)
    angles = [advance(state, command, k / 50 * end_s).angle_deg for k in range(51)]
    assert lowest <= min(angles) + 1e-6
    assert max(angles) - 1e-6 <= highest
    assert angles[-1] == pytest.approx(command.target_deg, abs=1e-6)


def test_a_target_behind_needs_no_stop_of_its_own() -> None:
    accelerations = [
        segment.acceleration_deg_s2 for segment in segments(ReferenceState(0.0, 10.0), MotionCommand(-20.0, 10.0, 20.0))
    ]
    moving = [value for value, _ in itertools.groupby(accelerations)]
    assert moving == [-20.0, 0.0, 20.0]


@settings(max_examples=200, deadline=None)
@given(
    start=st.floats(-400, 400),
    speed=st.floats(-40, 40),
    target=st.floats(-400, 400),
    top=st.floats(0.5, 40),
    rate=st.floats(1, 100),
)
def test_any_motion_begins_where_it_is_ends_at_its_target_and_never_steps(
    start: float, speed: float, target: float, top: float, rate: float
) -> None:
    motion = Motion.of(ReferenceState(start, speed), MotionCommand(target, top, rate))
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
    motion = Motion.of(ReferenceState(0.0, 20.0), MotionCommand(100.0, 10.0, 5.0))
    assert motion.segments[0] == (2.0, -5.0)
    assert motion.at(2.0) == (30.0, 10.0)


def test_no_way_takes_no_time() -> None:
    assert Motion.of(ReferenceState(3.0, 0.0), MotionCommand(3.0, 10.0, 10.0)).duration_s == 0.0
