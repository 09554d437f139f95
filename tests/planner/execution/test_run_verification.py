"""The verdict, on records with exactly known values."""

from dataclasses import replace

import numpy as np
import pytest

from planner.execution.run_input import RunInput
from planner.execution.run_record import Observation, Record
from planner.execution.run_verification import RunVerification, verify_run
from planner.execution.table_motion import Phase
from planner.map.config_map import ConfigurationMap
from planner.plans.plan import Wait
from tests.planner.run_examples import short_run_input


@pytest.fixture(scope="module")
def run_input() -> RunInput:
    return short_run_input()


def checked(run_input: RunInput, off_deg: float, *, failure: str | None = None, source: str = "L") -> RunVerification:
    """Return the verification of a run that was `off_deg` from the plan throughout."""
    motion = run_input.motion()
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
    assert result.verdict == "deviated: 0.300 deg at a location; allowed: 0.25"


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
    motion = run_input.motion()
    seen = [Observation(float(time_s), "L", 0.0, column) for column, time_s in enumerate(motion.column_times_s)]
    result = verify_run(run_input, motion, Record(observations=seen), lead_s=0.0)
    away = np.flatnonzero(np.abs(run_input.plan.angles_deg) > 1.0)
    assert set(away) <= set(result.missing_triggers)
    assert not result.is_verified


def margin_by_small_steps(configuration_map: ConfigurationMap, angles_deg: list[float]) -> float:
    """Return the distance of the nearest forbidden angle, searched outward from each angle in steps of 0.05 deg."""
    offsets_deg = np.arange(0.0, 180.0, 0.05)
    nearest = np.inf
    for location, angle_deg in enumerate(angles_deg):
        for sign in (-1.0, 1.0):
            for offset_deg in offsets_deg[offsets_deg < nearest]:
                if not configuration_map.is_allowed(location, angle_deg + sign * offset_deg):
                    nearest = float(offset_deg)
                    break
    return nearest


@pytest.mark.parametrize("seed", range(6))
def test_the_margin_is_that_of_a_search_in_small_steps(seed: int, run_input: RunInput) -> None:
    rng = np.random.default_rng(seed)
    plan, count = run_input.plan, len(run_input.plan.angles_deg)
    angle_count = int(rng.choice([24, 36, 90, 120]))
    values = rng.uniform(0.5, 1.0, (count, angle_count))
    # Forbidden cells everywhere except near the plan: around the turn and on both sides.
    for location, angle_deg in enumerate(plan.angles_deg):
        sample = int(rng.integers(angle_count))
        way_deg = abs((sample * 360.0 / angle_count - angle_deg + 180.0) % 360.0 - 180.0)
        if way_deg > 1.5 * 360.0 / angle_count:
            values[location, sample] = 0.0
    changed = replace(run_input, problem=replace(run_input.problem, map=ConfigurationMap(values)))
    turned = changed.turned(int(rng.integers(-2, 3)))
    result = checked(turned, 0.0)
    expected = margin_by_small_steps(turned.problem.map, turned.plan.angles_deg.tolist())
    assert result.margin_deg == pytest.approx(expected, abs=0.0501)


def test_the_margin_of_a_run_that_was_not_seen_is_unknown(run_input: RunInput) -> None:
    motion = run_input.motion()
    result = verify_run(run_input, motion, Record(), lead_s=0.0)
    assert np.isnan(result.margin_deg)
    assert not result.is_verified


@pytest.mark.parametrize("lead_s", [0.0, 0.01, 0.05])
def test_commands_sent_ahead_make_the_reference_early_and_the_encoder_less_late(
    run_input: RunInput, lead_s: float
) -> None:
    """A synthetic table: its reference is `lead_s` ahead of the plan's time, its encoder 20 ms behind that."""
    lag_s, motion = 0.02, run_input.motion()
    times_s = np.arange(0.1, motion.column_times_s[-1] - 0.1, 0.01)
    seen = [
        Observation(
            float(time_s), "inside",
            encoder_deg=motion.state_at(float(time_s) + lead_s - lag_s).angle_deg,
            reference_deg=motion.state_at(float(time_s) + lead_s).angle_deg,
        )
        for time_s in times_s
    ]  # fmt: skip
    deviations = verify_run(run_input, motion, Record(observations=seen), lead_s).deviations
    speeds = [motion.state_at(float(time_s)).speed_deg_s for time_s in times_s]
    assert deviations["reference"].anywhere_deg == pytest.approx(0.0, abs=1e-9)
    expected = abs(lead_s - lag_s) * float(np.abs(speeds).max())
    assert deviations["encoder"].anywhere_deg == pytest.approx(expected, rel=0.2, abs=0.01)


@pytest.mark.parametrize("location", [7, -1])
def test_a_forbidden_cell_that_is_touched_in_a_wait_is_reported(run_input: RunInput, location: int) -> None:
    """A table that halts passes its angle and comes back while the probe is at the location."""
    at = range(len(run_input.plan.angles_deg))[location]
    waiting = replace(run_input, plan=replace(run_input.plan, waits=(Wait(at, 2.0),)))
    motion = waiting.motion()
    leg = next(leg for leg in motion.legs if leg.phase is Phase.WAIT)
    blocked, angle_deg = waiting.problem.map.values.copy(), float(run_input.plan.angles_deg[at])
    sample = 2 + round(angle_deg / waiting.problem.map.angle_step_deg)
    beyond_deg = sample * waiting.problem.map.angle_step_deg
    blocked[at, sample % blocked.shape[1]] = 0.0
    problem = replace(waiting.problem, map=ConfigurationMap(blocked))
    seen = [
        Observation(leg.start_s + share * leg.duration_s, "H", angle)
        for share, angle in ((0.3, angle_deg), (0.5, beyond_deg), (0.7, angle_deg))
    ]
    result = verify_run(replace(waiting, problem=problem), motion, Record(observations=seen), lead_s=0.0)
    assert result.forbidden_steps == (min(at, len(run_input.plan.accelerations_deg_s2) - 1),)
    assert not result.is_verified


def test_a_stop_that_passes_into_a_forbidden_cell_is_reported(run_input: RunInput) -> None:
    motion, last = run_input.motion(), len(run_input.plan.angles_deg) - 1
    beside_deg = checked(run_input, 0.0).margin_deg
    seen = [
        Observation(motion.column_time_s(last) + 0.1, "H", float(run_input.plan.angles_deg[last]) + sign * off_deg)
        for sign in (-1.0, 1.0)
        for off_deg in np.arange(0.0, 180.0, max(1.0, 0.5 * beside_deg))
    ]
    result = verify_run(run_input, motion, Record(observations=seen), lead_s=0.0)
    assert result.forbidden_steps == (last - 1,)
