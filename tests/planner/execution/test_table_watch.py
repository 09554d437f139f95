"""Monitoring of a motion, here mostly of a table at rest, in virtual time."""

import numpy as np
import pytest

import emulator  # noqa: F401 - teaches pyserial the port emulator://
from planner.execution.run_record import Record
from planner.execution.table_watch import StrayedError, TableWatch
from planner.plans.plan import Plan
from planner.scanning.latched_run import ReadingMotion
from planner.table.cost import PathCost
from planner.table.motion import Limits
from planner.table.wire import Wire
from protocol import TableClient
from tests.planner.faulty_port import FaultyPort

STEPS = 40


def standing_still() -> Plan:
    zeros = np.zeros(STEPS + 1)
    return Plan("", "", 0.1, zeros, zeros, np.zeros(STEPS), PathCost(0.0, 0.0, 0.0))


def watch_on(
    port: FaultyPort, rate_hz: float = 10.0, with_view: bool = False, tolerance_deg: float = 1.0
) -> tuple[TableWatch, Record]:
    """Return a watch whose latch is read `rate_hz` times a second, and its record."""
    table, motion = TableClient(port, timeout_s=0.5), ReadingMotion(standing_still(), Limits(), rate_hz)
    record = Record(origin_s=port.clock.now_s())
    view = port.table if with_view else None
    return TableWatch(table, motion, Wire(), record, tolerance_deg, poll_s=0.05, look_s=0.02, view=view), record


def take_nothing(_time_s: float, _position_deg: float) -> None:
    """Ignore a reading."""


def times_s(record: Record, source: str) -> list[float]:
    return [each.time_s for each in record.observations if each.source == source]


@pytest.mark.parametrize("rate_hz", [10.0, 25.0, 50.0, 100.0])
def test_reading_is_over_in_time_and_the_position_is_read_however_fast_triggers_come(rate_hz: float) -> None:
    watch, record = watch_on(FaultyPort(), rate_hz)
    for end_s in np.arange(0.1, 4.0, 0.1):
        watch.read_until(float(end_s), take_nothing)
        assert watch.now_s() == pytest.approx(end_s, abs=0.0011)
    assert np.diff(times_s(record, "H")).max() < 0.35
    assert len(times_s(record, "L")) > 30


def test_a_position_off_the_plan_is_straying() -> None:
    port = FaultyPort()
    TableClient(port).move_to(5.0)
    watch, record = watch_on(port)
    with pytest.raises(StrayedError, match=r"should be at 0.0, more than 1 deg off"):
        watch.read_until(2.0, take_nothing)
    assert 1.0 < record.observations[-1].encoder_deg < 1.5


def test_a_latch_off_the_plan_is_a_trigger_that_was_missed_and_no_straying() -> None:
    port = FaultyPort()
    table = TableClient(port)
    table.move_to(20.0)
    table.wait_until_at(20.0)
    port.table.trigger()
    table.move_to(0.0)
    table.wait_until_at(0.0)
    watch, record = watch_on(port)
    watch.read_until(1.0, take_nothing)
    assert {each.encoder_deg for each in record.observations if each.source == "L"} == {20.0}


def test_the_time_of_an_answer_that_came_late_is_not_relied_upon() -> None:
    def dawdle(data: bytes) -> bytes:
        port.table.advance(20)
        return data

    port = FaultyPort(dawdle)
    watch, record = watch_on(port)
    taken: list[float] = []
    watch.read_until(1.0, lambda time_s, _: taken.append(time_s))
    assert times_s(record, "H late")
    assert not times_s(record, "H")
    assert not taken


def test_a_table_that_can_be_looked_into_is_looked_into_all_the_while_and_triggered_at_each_location() -> None:
    port = FaultyPort()
    watch, record = watch_on(port, with_view=True)
    watch.read_until(3.0, take_nothing)
    looks = [each for each in record.observations if each.source == "inside"]
    assert np.diff([each.time_s for each in looks]).max() < 0.05
    triggered = [each.time_s for each in looks if each.column is not None]
    assert triggered == pytest.approx(ReadingMotion(standing_still(), Limits(), 10.0).column_times_s[:30], abs=0.016)
    assert all(each.encoder_deg == each.reference_deg for each in looks)
