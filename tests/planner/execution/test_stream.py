"""The stream by the controller's rules: bounds for any plan, step and number of decimals."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.arrays import FloatArray
from planner.defaults import RUN_ON_DEG
from planner.execution.run_on import latest_s
from planner.execution.stream import Streaming, TimedCommand, check_it_fits, reference_states, rounded_stream, stream
from planner.execution.table_motion import TableMotion
from planner.plans.plan import Plan
from planner.table.cost import PathCost
from planner.table.motion import Limits, roll_out
from planner.table.wire import StreamError, Wire
from protocol.trapezoid import advance
from tests.planner.run_examples import paused_run_input
from tools.bench.stream import random_plan, stream_figures

LIMITS = Limits()


def plan_of(accelerations_deg_s2: list[float], step_s: float, start_deg: float = 10.0) -> Plan:
    accelerations = np.array(accelerations_deg_s2)
    angles, speeds = roll_out(start_deg, 0.0, accelerations, step_s)
    return Plan("", "", step_s, angles, speeds, accelerations, PathCost(0.0, 0.0, 0.0))


def errors_of(motion: TableMotion, commands: tuple[TimedCommand, ...], times_s: FloatArray) -> FloatArray:
    angles = np.array([state.angle_deg for state in reference_states(commands, times_s)])
    return np.abs(angles - motion.angles_at(times_s))


@given(
    seed=st.integers(0, 10_000),
    step_s=st.sampled_from([0.06, 0.1, 0.25, 0.5, 1.0]),
    decimals=st.integers(1, 3),
    # Limits that can be transmitted: a plan at a speed of 1.75 cannot be followed with one decimal.
    limits=st.builds(Limits, st.integers(5, 400).map(lambda n: n / 10), st.integers(10, 1000).map(lambda n: n / 10)),
)
@settings(max_examples=20, deadline=None)
def test_the_reference_stays_with_any_plan_within_limits(
    seed: int, step_s: float, decimals: int, limits: Limits
) -> None:
    plan = random_plan(np.random.default_rng(seed), step_s, 20 * step_s, limits)
    motion = TableMotion(plan, limits)
    commands = stream(motion, limits, Wire(decimals))
    for timed in commands:
        assert 0.0 < timed.command.speed_deg_s <= limits.speed_deg_s
        assert 0.0 < timed.command.acceleration_deg_s2 <= limits.acceleration_deg_s2
    # One unit of the last place, in S or A, over one step; and half of one in the start and the rest.
    unit = 10.0**-decimals
    bound = 0.5 * unit + 0.1 * unit * step_s + 1e-6
    assert errors_of(motion, commands, motion.column_times_s).max() <= bound
    assert errors_of(motion, commands, np.linspace(0.0, motion.end_s, 400)).max() <= max(bound + 0.5 * unit, 0.15)


@given(
    seed=st.integers(0, 10_000),
    step_s=st.sampled_from([0.05, 0.1, 0.35, 0.55, 1.0, 2.0, 5.0]),
    decimals=st.integers(1, 3),
    limits=st.sampled_from([LIMITS, Limits(40.0, 20.0), Limits(10.0, 5.0), Limits(120.0, 300.0)]),
    run_on_deg=st.sampled_from([30.0, 90.0, 200.0]),
)
@settings(max_examples=20, deadline=None)
def test_no_command_lets_the_table_run_on_farther_than_chosen_or_needed(
    seed: int, step_s: float, decimals: int, limits: Limits, run_on_deg: float
) -> None:
    plan = random_plan(np.random.default_rng(seed), step_s, 15 * step_s, limits)
    motion = TableMotion(plan, limits)
    commands = stream(motion, limits, Wire(decimals, 115_200), run_on_deg)
    speed = float(np.abs(plan.speeds_deg_s).max())
    needed_deg = 0.5 * speed**2 / limits.acceleration_deg_s2 + speed * (step_s + latest_s(step_s))
    figures = stream_figures(motion, commands)
    assert figures.run_on_deg <= max(run_on_deg, needed_deg) + 0.2
    if run_on_deg == 90.0:
        assert figures.between_deg <= 0.15


def test_commands_follow_one_another_no_faster_than_the_line_carries_them() -> None:
    wire = Wire()
    for step_s in (0.06, 0.08, 0.1, 0.3, 1.0):
        motion = TableMotion(random_plan(np.random.default_rng(4), step_s, 40 * step_s, LIMITS), LIMITS)
        check_it_fits(stream(motion, LIMITS, wire, 30.0), wire)


def test_errors_are_taken_out_and_do_not_add_up() -> None:
    plan = random_plan(np.random.default_rng(3), 0.1, 60.0, LIMITS)
    motion = TableMotion(plan, LIMITS)
    fed_back = errors_of(motion, stream(motion, LIMITS, Wire()), motion.column_times_s)
    rounded = errors_of(motion, rounded_stream(motion, LIMITS, Wire()), motion.column_times_s)
    assert fed_back.max() < 0.004
    assert rounded.max() > 10.0 * fed_back.max()


def test_the_prediction_goes_on_from_command_to_command() -> None:
    motion = TableMotion(random_plan(np.random.default_rng(5), 0.1, 5.0, LIMITS), LIMITS)
    commands = stream(motion, LIMITS, Wire())
    for before, after in pairwise(commands):
        reached = advance(before.expected, before.command, after.time_s - before.time_s)
        assert reached == pytest.approx(after.expected, abs=1e-9)


def test_the_table_does_not_brake_for_a_target_when_the_next_command_is_late() -> None:
    motion = TableMotion(plan_of([20.0] * 10 + [0.0] * 30, 0.1), LIMITS)
    for timed in stream(motion, LIMITS, Wire())[12:38]:
        late = advance(timed.expected, timed.command, timed.leg.duration_s + 0.09)
        assert late.speed_deg_s == pytest.approx(20.0, abs=0.2)


def test_a_table_whose_line_dies_soon_stands() -> None:
    motion = TableMotion(plan_of([20.0] * 10 + [0.0] * 30, 0.1), LIMITS)
    for timed in stream(motion, LIMITS, Wire())[12:38]:
        assert abs(timed.command.target_deg - timed.expected.angle_deg) < 100.0


def test_a_change_of_direction_within_a_step_needs_no_stop() -> None:
    motion = TableMotion(plan_of([10.0] * 10 + [-13.0] * 20, 0.1), LIMITS)
    commands = stream(motion, LIMITS, Wire())
    assert len(commands) == 31
    assert errors_of(motion, commands, np.linspace(0.0, 3.0, 300)).max() < 0.01


def test_speeds_below_the_smallest_number_are_followed() -> None:
    motion = TableMotion(plan_of([0.05] * 10 + [0.0] * 20, 0.1), LIMITS)
    assert errors_of(motion, stream(motion, LIMITS, Wire()), motion.column_times_s).max() < 0.02


def test_a_standing_plan_stands_on_its_angle() -> None:
    motion = TableMotion(plan_of([0.0] * 5, 0.5, start_deg=12.3), LIMITS)
    states = reference_states(stream(motion, LIMITS, Wire()), np.linspace(0.0, 2.5, 20))
    assert {state.angle_deg for state in states} == {12.3}


def test_it_ends_at_rest_on_the_last_angle() -> None:
    motion = TableMotion(plan_of([20.0] * 10, 0.1), LIMITS)
    *_, last = stream(motion, LIMITS, Wire())
    assert last.command.target_deg == round(float(motion.plan.angles_deg[-1]), 1)
    assert advance(last.expected, last.command, last.leg.duration_s).speed_deg_s == 0.0


def test_a_pause_is_part_of_the_stream() -> None:
    motion = TableMotion(paused_run_input().plan, LIMITS)
    errors = errors_of(motion, stream(motion, LIMITS, Wire()), motion.column_times_s)
    assert errors.max() < 0.06


def test_what_does_not_fit_the_wire_is_refused_with_a_step_that_does() -> None:
    generator = np.random.default_rng(1)
    wire = Wire()
    quick = TableMotion(random_plan(generator, 0.04, 2.0, LIMITS), LIMITS)
    with pytest.raises(
        StreamError, match=r"at 9600 baud.* previous step takes 40 ms; use a time step of at least 0\.\d+ s"
    ) as refusal:
        check_it_fits(stream(quick, LIMITS, wire), wire)
    fitting_s = float(str(refusal.value).split("at least ")[1].split()[0])
    slow = TableMotion(random_plan(generator, fitting_s, 2.0, LIMITS), LIMITS)
    check_it_fits(stream(slow, LIMITS, wire), wire)
    check_it_fits(stream(quick, LIMITS, Wire(baud=115_200)), Wire(baud=115_200, turnaround_s=0.001))


def test_limits_that_the_wire_cannot_say_are_refused() -> None:
    motion = TableMotion(plan_of([0.0], 0.1), Limits(0.05, 1.0))
    with pytest.raises(StreamError, match=r"must be at least 0\.1"):
        stream(motion, Limits(0.05, 1.0), Wire())


def test_a_stream_that_is_computed_again_follows_the_plan_as_the_first_one() -> None:
    """From any command on: its target serves until the next one, and does not brake the table before that."""
    limits = Limits(40.0, 100.0)
    motion = TableMotion(plan_of([-20.0, 2.93, 16.69, 0.89, 0.0], 1.15), limits)
    streaming = Streaming(motion, limits, Wire(), RUN_ON_DEG)
    commands = streaming.commands()
    for k, (running, following) in enumerate(pairwise(commands)):
        again = next(streaming.commands_after(running, k + 1, following.time_s))
        end_s = following.leg.end_s
        if following.leg.command is None:
            times_s = np.linspace(again.time_s, end_s, 20)[:-1]
            reached = [again.going_on_at(time_s).angle_deg for time_s in times_s.tolist()]
            assert np.abs(reached - motion.angles_at(times_s)).max() < 0.2
