"""A small share of the benchmark's measurements, as tests."""

from collections.abc import Callable, Sequence

import numpy as np
import pytest

from planner.arrays import FloatArray
from planner.execution.execute import Settings
from planner.execution.stream import TimedCommand, reference_states, rounded_stream, stream
from planner.execution.table_motion import TableMotion
from planner.plans.plan import Plan
from planner.table.motion import Limits
from planner.table.wire import Wire
from tools.bench.stream import LEAD_S, random_plan
from tools.bench.virtual_run import random_run_inputs, run_in_virtual_time


def errors_at_locations(plan: Plan, limits: Limits, streamed: Callable[..., Sequence[TimedCommand]]) -> FloatArray:
    """Return the deviation of the reference from a plan at each location, by the controller's rules."""
    motion = TableMotion(plan, limits)
    states = reference_states(streamed(motion, limits, Wire()), motion.column_times_s)
    return np.array([state.angle_deg for state in states]) - plan.angles_deg


def test_a_random_plan_keeps_the_limits() -> None:
    limits = Limits(30.0, 50.0)
    plan = random_plan(np.random.default_rng(0), 0.1, 20.0, limits)
    assert np.abs(plan.speeds_deg_s).max() <= limits.speed_deg_s + 1e-9
    assert np.abs(plan.accelerations_deg_s2).max() <= limits.acceleration_deg_s2 + 1e-9


@pytest.mark.parametrize("step_s", [0.1, 1.0])
def test_feeding_errors_back_beats_rounding_each_on_its_own(step_s: float) -> None:
    limits = Limits()
    plan = random_plan(np.random.default_rng(1), step_s, 60.0, limits)
    fed_back, rounded = (
        np.abs(errors_at_locations(plan, limits, streamed)).max() for streamed in (stream, rounded_stream)
    )
    assert fed_back < 0.004 if step_s == 0.1 else fed_back < 0.04
    assert rounded > 5.0 * fed_back


def test_no_random_plan_touches_a_forbidden_cell() -> None:
    for run_input in random_run_inputs(8):
        run = run_in_virtual_time(run_input, settings=Settings(lead_s=LEAD_S))
        assert run.checked.is_verified, f"{run_input.name}: {run.checked.verdict}"
        assert run.checked.worst_deg < 0.1
        assert run.checked.latest_command_s <= 0.001
