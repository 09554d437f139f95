"""The verdict, on records made by hand: what was seen is known exactly."""

import numpy as np
import pytest

from planner.execution.run_input import RunInput
from planner.execution.run_record import Observation, Record
from planner.execution.run_verification import RunVerification, verify_run
from planner.execution.table_motion import TableMotion
from tests.planner.run_examples import short_run_input


@pytest.fixture(scope="module")
def run_input() -> RunInput:
    return short_run_input()


def checked(run_input: RunInput, off_deg: float, *, failure: str | None = None, source: str = "L") -> RunVerification:
    """Return the verification of a run that was `off_deg` from the plan throughout."""
    motion = TableMotion(run_input.plan, run_input.problem.limits)
    seen = [
        Observation(time_s, source, float(angle_deg) + off_deg, column if source == "L" else None)
        for column, (time_s, angle_deg) in enumerate(zip(motion.column_times_s, run_input.plan.angles_deg, strict=True))
    ]
    return verify_run(run_input, motion, Record(observations=seen, failure=failure), lead_s=0.0)


def test_a_run_on_the_plan_is_verified_and_costs_what_was_planned(run_input: RunInput) -> None:
    result = checked(run_input, 0.0)
    assert result.is_verified
    assert result.worst_deg == pytest.approx(0.0, abs=1e-9)
    assert result.executed_cost is not None
    assert result.executed_cost.value == pytest.approx(result.planned_cost.value)
    assert result.executed_cost.speed == pytest.approx(result.planned_cost.speed, rel=0.2)


def test_a_run_beside_the_plan_has_deviated(run_input: RunInput) -> None:
    result = checked(run_input, 0.3)
    assert not result.is_verified
    assert result.verdict == "deviated: 0.300 deg at a location, allowed are 0.25"


def test_a_path_into_a_forbidden_cell_has_deviated(run_input: RunInput) -> None:
    beyond_deg = checked(run_input, 0.0).margin_deg + 0.05
    touching = [checked(run_input, sign * beyond_deg, source="H") for sign in (-1.0, 1.0)]
    assert any(each.forbidden_steps for each in touching)
    assert not any(each.is_verified for each in touching)


def test_a_stopped_run_is_not_verified(run_input: RunInput) -> None:
    result = checked(run_input, 0.0, failure="interrupted")
    assert not result.is_verified
    assert result.verdict == "stopped: interrupted"


def test_without_triggers_the_polled_positions_count(run_input: RunInput) -> None:
    result = checked(run_input, 0.1, source="H")
    assert result.is_verified
    assert len(result.missing_triggers) == len(run_input.plan.angles_deg)
    np.testing.assert_allclose(result.located_deg, run_input.plan.angles_deg + 0.1, atol=1e-9)


def test_a_latch_of_an_earlier_trigger_does_not_count(run_input: RunInput) -> None:
    motion = TableMotion(run_input.plan, run_input.problem.limits)
    seen = [Observation(float(time_s), "L", 0.0, column) for column, time_s in enumerate(motion.column_times_s)]
    result = verify_run(run_input, motion, Record(observations=seen), lead_s=0.0)
    away = np.flatnonzero(np.abs(run_input.plan.angles_deg) > 1.0)
    assert set(away) <= set(result.missing_triggers)
    assert not result.is_verified
