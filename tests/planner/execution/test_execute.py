"""Execution in virtual time: on a healthy table, and on tables and lines that fail during the run."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import emulator  # noqa: F401 - teaches pyserial the port emulator://
from planner.execution.execute import ExecutionError, Settings, bring_to, execute
from planner.execution.run_record import Record
from planner.execution.table_motion import Phase, TableMotion
from planner.execution.table_port import ScaledClock
from planner.plans.plan import Plan
from planner.table.cost import PathCost
from planner.table.motion import Limits, roll_out
from planner.table.wire import Wire
from protocol import TableClient
from tests.planner.faulty_port import FaultyPort, hang_up, lose
from tests.planner.run_examples import paused_run_input, short_run_input

LIMITS, WIRE = Limits(), Wire()
Progress = Callable[[int, int], None]


def motion_at(speed_deg_s: float, duration_s: float) -> TableMotion:
    """Return a motion that accelerates for a second and continues."""
    steps = round(duration_s / 0.1)
    accelerations = np.zeros(steps)
    accelerations[:10] = speed_deg_s
    angles, speeds = roll_out(0.0, 0.0, accelerations, 0.1)
    return TableMotion(Plan("", "", 0.1, angles, speeds, accelerations, PathCost(0.0, 0.0, 0.0)), LIMITS)


def run(
    motion: TableMotion, port: FaultyPort, settings: Settings | None = None, progress: Progress | None = None
) -> Record:
    table = TableClient(port, timeout_s=0.5)
    bring_to(table, motion.start_deg, LIMITS, WIRE)
    return execute(table, motion, LIMITS, WIRE, settings, port.table, progress)


def stands(port: FaultyPort) -> bool:
    port.table.advance(8000)
    return port.table.status().state in {"idle", "stalled"}


def test_every_command_is_sent_in_time_and_every_trigger_is_latched() -> None:
    motion = TableMotion(short_run_input().plan, LIMITS)
    record = run(motion, FaultyPort())
    assert record.failure is None
    assert len(record.sent) == len(motion.legs)
    assert max(sent.late_s for sent in record.sent) <= 0.001
    columns = [each.column for each in record.observations if each.source == "L"]
    assert columns == list(range(len(motion.plan.angles_deg)))


def test_positions_are_polled_between_commands() -> None:
    record = run(motion_at(10.0, 3.0), FaultyPort())
    polled = [each.time_s for each in record.observations if each.source == "H"]
    assert len(polled) > 30
    assert np.diff(polled).max() < 0.15


def test_a_pause_turns_the_table_between_two_locations() -> None:
    motion = TableMotion(paused_run_input().plan, LIMITS)
    record = run(motion, FaultyPort())
    assert record.failure is None
    assert [sent.phase for sent in record.sent if sent.column == 9] == [Phase.RETRACT, Phase.ROTATE, Phase.APPROACH]
    latched = {each.column: each.encoder_deg for each in record.observations if each.source == "L"}
    assert latched[10] == pytest.approx(motion.plan.angles_deg[10], abs=0.15)


def test_with_the_lead_of_its_lag_the_encoder_is_in_time() -> None:
    motion = motion_at(25.0, 4.0)

    def worst_deg(lead_s: float) -> float:
        record = run(motion, FaultyPort(), Settings(lead_s=lead_s))
        seen = [each for each in record.observations if each.source == "inside" and 1.0 < each.time_s < 4.0]
        return max(abs(each.encoder_deg - motion.state_at(each.time_s).angle_deg) for each in seen)

    assert worst_deg(0.0) < 0.25
    assert worst_deg(Settings().lag_s) < 0.05


def test_drift_of_the_clocks_is_corrected() -> None:
    motion = motion_at(25.0, 12.0)

    def last_deviation_deg(settings: Settings) -> float:
        port = FaultyPort()
        port.clock = ScaledClock(port.clock, 1.002)
        record = run(motion, port, settings)
        assert record.failure is None
        assert bool(record.corrections) == (settings.drift_deg < 1.0)
        latched = [each for each in record.observations if each.source == "L"][-1]
        return abs(latched.encoder_deg - motion.state_at(latched.time_s).angle_deg)

    in_time = Settings(lead_s=Settings().lag_s)
    assert last_deviation_deg(in_time._replace(drift_deg=100.0)) > 0.45
    assert last_deviation_deg(in_time) < 0.35


@pytest.mark.parametrize("torque_constant_Nm_A", [0.0187, 0.0281])
def test_the_lag_of_another_motor_is_not_taken_for_drift(torque_constant_Nm_A: float, tmp_path: Path) -> None:
    config = tmp_path / "table.toml"
    config.write_text(f"[motor]\ntorque_constant_Nm_A = {torque_constant_Nm_A}\n", encoding="utf-8")
    record = run(motion_at(25.0, 12.0), FaultyPort(url=f"emulator://?config={config}"))
    assert record.failure is None
    assert not record.corrections


def test_a_line_that_dies_is_reported_and_what_was_seen_is_kept() -> None:
    record = run(motion_at(10.0, 4.0), FaultyPort(hang_up, fault_s=2.0))
    assert record.failure is not None
    assert "the port failed" in record.failure
    assert not record.has_strayed
    assert 5 < len(record.sent) < 30
    assert record.observations


def test_a_table_whose_line_died_comes_to_rest_by_itself() -> None:
    port = FaultyPort(hang_up, fault_s=2.0)
    run(motion_at(10.0, 4.0), port)
    port.table.advance(10_000)
    assert port.table.status().state == "idle"


def test_an_error_reply_stops_the_table() -> None:
    port = FaultyPort(lambda _: b"ERR 5 bad byte\r", fault_s=2.0, faults=1)
    record = run(motion_at(10.0, 4.0), port)
    assert record.failure is not None
    assert "got ERR 5 bad byte" in record.failure
    assert stands(port)


@pytest.mark.parametrize("faults", [1, 1_000_000])
def test_a_lost_reply_stops_the_table(faults: int) -> None:
    port = FaultyPort(lose, fault_s=2.0, faults=faults)
    record = run(motion_at(10.0, 4.0), port)
    assert record.failure is not None
    assert "no reply to it within 0.5 s" in record.failure
    assert stands(port)
    assert port.table.status().reference_deg < 35.0


def test_a_stalled_table_is_stopped_as_strayed() -> None:
    port = FaultyPort()

    def block(time_ms: int, _: int) -> None:
        if time_ms > 2000:
            port.table.set_load_torque(200.0)

    record = run(motion_at(10.0, 4.0), port, progress=block)
    assert record.has_strayed
    assert record.failure is not None
    assert "more than 1 deg off; check that the table turns freely" in record.failure
    assert stands(port)


def test_an_interrupt_stops_the_table() -> None:
    port = FaultyPort()

    def interrupt(time_ms: int, _: int) -> None:
        if time_ms > 1500:
            raise KeyboardInterrupt

    record = run(motion_at(10.0, 4.0), port, progress=interrupt)
    assert record.failure is not None
    assert record.failure.startswith("interrupted; the table was stopped and stands at ")
    assert stands(port)
    assert port.table.status().reference_deg < 20.0


def test_a_command_that_came_late_is_made_up_for() -> None:
    def pause_once(data: bytes) -> bytes:
        port.table.advance(80)
        return data

    port = FaultyPort(pause_once, fault_s=1.0, faults=1)
    motion = motion_at(25.0, 3.0)
    record = run(motion, port, Settings(lead_s=Settings().lag_s))
    assert record.failure is None
    assert max(sent.late_s for sent in record.sent) > 0.01
    assert record.corrections
    after = [each for each in record.observations if each.source == "inside" and 2.0 < each.time_s < 3.0]
    assert max(abs(each.encoder_deg - motion.state_at(each.time_s).angle_deg) for each in after) < 0.05


@pytest.mark.parametrize("lead_s", [0.0, 0.04, 0.1])
def test_a_lead_makes_the_reference_early_by_that_time(lead_s: float) -> None:
    port = FaultyPort()
    record = run(motion_at(20.0, 3.0), port, Settings(lead_s=lead_s, tolerance_deg=10.0))
    assert record.failure is None
    steady = [each for each in record.observations if each.source == "inside" and 1.0 < each.time_s < 2.5]
    planned_deg = [motion_at(20.0, 3.0).state_at(each.time_s).angle_deg for each in steady]
    # At a constant 20 deg/s, an angle ahead corresponds to a time ahead.
    reference_deg = np.array([each.reference_deg for each in steady], dtype=np.float64)
    ahead_s = np.mean(reference_deg - planned_deg) / 20.0
    behind_s = np.mean(reference_deg - [each.encoder_deg for each in steady]) / 20.0
    assert ahead_s == pytest.approx(lead_s, abs=0.001)
    assert behind_s == pytest.approx(Settings().lag_s, abs=0.002)


def test_a_table_that_answers_late_is_stopped() -> None:
    def dawdle(data: bytes) -> bytes:
        port.table.advance(200)
        return data

    port = FaultyPort(dawdle, fault_s=2.0)
    record = run(motion_at(10.0, 4.0), port)
    assert record.failure is not None
    assert "is too slow" in record.failure
    assert stands(port)


def test_it_is_brought_to_the_start_at_the_limits() -> None:
    port = FaultyPort()
    table = TableClient(port)
    bring_to(table, 80.0, LIMITS, WIRE)
    assert table.position_deg() == pytest.approx(80.0, abs=0.1)
    assert port.clock.now_s() < 3.5


def test_limits_beyond_those_of_the_table_are_refused_before_anything_moves() -> None:
    port = FaultyPort()
    with pytest.raises(ExecutionError, match="create a plan within the limits of the table"):
        bring_to(TableClient(port), 80.0, Limits(60.0, 100.0), WIRE)
    assert port.table.status().reference_deg == pytest.approx(0.0, abs=0.01)
