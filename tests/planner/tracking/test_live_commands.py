"""A tracker between a source of locations and a table, in simulated time."""

import numpy as np
import pytest

from planner.arrays import FloatArray
from planner.errors import PlannerError
from planner.table.wire import Wire
from planner.tracking.live_commands import LiveCommands
from planner.tracking.pose_lines import SourceError
from planner.tracking.tracker import Column, Tracked
from tests.planner.tracking.track_examples import begun_tracker, locations

VIEW = 8


class Observer:
    """Keeps the steps that were taken."""

    def __init__(self) -> None:
        self.steps: list[Tracked] = []

    def revealed(self, column: Column) -> None:
        """Keep nothing."""

    def tracked(self, tracked: Tracked, seconds: float) -> None:  # noqa: ARG002 - see the protocol
        """Keep a step."""
        self.steps.append(tracked)


class TimedSource:
    """Locations that come one at a time at given times; afterwards, nothing, or the end."""

    def __init__(self, T_WS: FloatArray, times_s: list[float], ends: bool) -> None:
        self.now_s, self.waits = -1.0, 0
        self._coming, self._ends = list(zip(times_s, T_WS, strict=True)), ends

    @property
    def has_ended(self) -> bool:
        """Whether the end came after the last location."""
        return self._ends and not self._coming

    def take(self, room: int, wait_s: float = 0.0) -> list[FloatArray]:
        """Return what has come until now, or in virtual time the next one."""
        taken: list[FloatArray] = []
        while self._coming and len(taken) < room and self._coming[0][0] <= self.now_s:
            taken.append(self._coming.pop(0)[1])
        self.waits += wait_s > 0.0 and not taken
        return taken


def carried_out(source: TimedSource, wait_s: float, is_real_time: bool) -> tuple[Observer, PlannerError | None, float]:
    """Track what a source sends, and return the steps, the fault that ended it, and where the table was then."""
    tracker, observer = begun_tracker(locations()[: VIEW + 1], VIEW, ends=False), Observer()
    commands = LiveCommands(tracker, source, observer, lambda: source.now_s, wait_s, is_real_time)
    fault = None
    try:
        while (timed := commands.next()) is not None:
            commands.sent(timed, 0.0)
            begin_s = commands.begin_s(Wire(), None)
            source.now_s = source.now_s if begin_s is None else max(source.now_s, begin_s)
    except PlannerError as error:
        fault = error
    assert tracker.state.is_at_rest
    return observer, fault, source.now_s


def test_locations_that_trickle_in_slower_than_the_table_resumes_are_waited_for() -> None:
    """The table goes on with a view of several locations; each that comes starts the wait again."""
    rest = locations()[VIEW + 1 :]
    source = TimedSource(rest, [4.0 * (k + 1) for k in range(len(rest))], ends=True)
    observer, fault, _ = carried_out(source, wait_s=5.0, is_real_time=True)
    assert fault is None
    assert observer.steps[-1].step is None
    assert sum(each.step is not None and each.step.kind == "wait" for each in observer.steps) > 40


def test_when_nothing_comes_any_more_the_table_waits_at_rest_and_then_the_scan_ends() -> None:
    source = TimedSource(locations()[:0], [], ends=False)
    _, fault, now_s = carried_out(source, wait_s=5.0, is_real_time=True)
    assert isinstance(fault, SourceError)
    assert str(fault) == 'poses: no location came for 5 s after location 8; send "end" after the last one'
    assert 5.0 < now_s < 5.0 + 10.0


def test_in_simulated_time_a_source_is_waited_for_once_and_then_the_table_comes_to_rest() -> None:
    source = TimedSource(locations()[:0], [], ends=False)
    observer, fault, _ = carried_out(source, wait_s=5.0, is_real_time=False)
    assert isinstance(fault, SourceError)
    assert "no location came for 5 s after location 8" in str(fault)
    assert source.waits == 1
    assert len(observer.steps) < VIEW + 4


@pytest.mark.parametrize("is_real_time", [False, True])
def test_locations_in_time_are_tracked_without_a_wait(is_real_time: bool) -> None:
    rest = locations()[VIEW + 1 :]
    observer, fault, _ = carried_out(TimedSource(rest, [-np.inf] * len(rest), ends=True), 5.0, is_real_time)
    assert fault is None
    assert all(each.step is None or each.step.kind == "scan" for each in observer.steps)
