"""The line fails during a run: how far an emulated table runs on, and what the report states about it."""

from collections.abc import Callable

import numpy as np
import pytest

from emulator.table.table import Snapshot, Table
from planner.defaults import shipped_scans
from planner.execution.dead_line import DeadLine, judge_dead_line
from planner.execution.execute import Settings, bring_to, execute
from planner.execution.run_on import latest_s
from planner.execution.run_record import Record
from planner.execution.table_motion import Phase, TableMotion
from planner.map.config_map import ConfigurationMap
from planner.map.synthetic_maps import blocks_map
from planner.plans.plan import Plan
from planner.table.cost import PathCost
from planner.table.motion import Limits, roll_out
from planner.table.wire import Wire
from protocol import TableClient
from tests.planner.faulty_port import FaultyPort
from tests.planner.run_examples import paused_run_input
from tools.bench.stream import random_plan
from tools.bench.virtual_run import shipped_run_input

EVERY = 20


def ways_after_a_cut(
    motion: TableMotion, limits: Limits, run_on_deg: float, every: int = EVERY
) -> tuple[Record, list[float]]:
    """Run a motion, and return how far the table continues when the line is cut at regular readings.

    Each distance is that of a copy of the table that receives nothing any more, until it stands.
    """
    port = FaultyPort()
    snapshots: list[Snapshot] = []
    seen = iter(range(1_000_000))

    def look(_: int, __: int) -> None:
        if next(seen) % every == 0:
            assert isinstance(port.table, Table)
            snapshots.append(port.table.snapshot())

    table, wire = TableClient(port, timeout_s=0.5), Wire()
    bring_to(table, motion.start_deg, limits, wire)
    record = execute(table, motion, limits, wire, Settings(run_on_deg=run_on_deg), progress=look)
    return record, [_way_deg(Table(port.table.config), each) for each in snapshots]


def _way_deg(table: Table, snapshot: Snapshot) -> float:
    table.restore(snapshot)
    begin_deg, way_deg = table.status().encoder_deg, 0.0
    while table.status().state == "moving":
        table.advance(50)
        way_deg = max(way_deg, abs(table.status().encoder_deg - begin_deg))
    return way_deg


@pytest.mark.parametrize("name", shipped_scans())
def test_after_a_cut_at_any_moment_a_shipped_plan_runs_on_by_less_than_is_promised(name: str) -> None:
    run_input = shipped_run_input(name)
    motion = run_input.motion()
    record, ways_deg = ways_after_a_cut(motion, run_input.problem.limits, 90.0)
    assert record.failure is None
    assert len(ways_deg) > 30
    assert max(ways_deg) <= 90.0
    judged = judge_dead_line(run_input.problem.map, motion, record)
    assert max(ways_deg) - 0.5 <= judged.longest_deg <= 90.0


@pytest.mark.parametrize(
    ("step_s", "limits", "run_on_deg"),
    [
        (0.1, Limits(), 20.0),
        (2.0, Limits(), 90.0),
        (5.0, Limits(), 45.0),
        (0.2, Limits(40.0, 20.0), 60.0),
    ],
)
def test_the_promise_holds_for_other_steps_limits_and_choices(step_s: float, limits: Limits, run_on_deg: float) -> None:
    plan = random_plan(np.random.default_rng(7), step_s, 30.0, limits)
    record, ways_deg = ways_after_a_cut(TableMotion(plan, limits), limits, run_on_deg, every=5)
    assert record.failure is None
    speed = float(np.abs(plan.speeds_deg_s).max())
    needed_deg = 0.5 * speed**2 / limits.acceleration_deg_s2 + speed * (step_s + latest_s(step_s))
    assert max(ways_deg) <= max(run_on_deg, needed_deg)


def test_the_turn_of_a_pause_is_cut_short_too() -> None:
    run_input = paused_run_input()
    motion = TableMotion(run_input.plan, Limits())
    record, ways_deg = ways_after_a_cut(motion, Limits(), 25.0, every=2)
    turning = [sent for sent in record.sent if sent.phase is Phase.ROTATE]
    assert len(turning) > 1
    assert turning[-1].command.target_deg == pytest.approx(run_input.plan.angles_deg[10], abs=0.05)
    assert max(ways_deg) <= 25.0


def steady_motion() -> TableMotion:
    """Return a motion at 10 deg/s from 0 deg, with a location every 0.5 s."""
    accelerations = np.array([20.0] + [0.0] * 18 + [-20.0])
    angles, speeds = roll_out(0.0, 0.0, accelerations, 0.5)
    return TableMotion(Plan("", "", 0.5, angles, speeds, accelerations, PathCost(0.0, 0.0, 0.0)), Limits())


def judged(configuration_map: ConfigurationMap) -> DeadLine:
    motion = steady_motion()
    table = TableClient(FaultyPort(), timeout_s=0.5)
    record = execute(table, motion, Limits(), Wire())
    return judge_dead_line(configuration_map, motion, record)


def test_a_way_on_that_stays_free_is_said_to() -> None:
    verdict = judged(ConfigurationMap(np.ones((21, 360))))
    assert verdict.forbidden_moments == 0
    assert verdict.first_s is None
    assert verdict.moments == pytest.approx(10.3 / 0.02, abs=10)
    assert "none of" in str(verdict)


def test_a_region_that_only_the_way_on_meets_is_named_with_its_first_moment() -> None:
    """The region is only at location 11, just ahead of the table, which is then at 52.5 deg."""
    verdict = judged(blocks_map(21, 360, [(11, 11, 54, 80)]))
    assert 0 < verdict.forbidden_moments < 100
    # With the arm between 10 and 11 it may already stand at 11.
    assert verdict.first_location == 10
    assert verdict.first_s == pytest.approx(5.0, abs=0.03)
    assert f"the first is at {verdict.first_s:.2f} s, location 10" in str(verdict)


def test_a_region_beyond_the_way_on_does_not_count() -> None:
    assert judged(blocks_map(21, 360, [(11, 12, 200, 300)])).forbidden_moments == 0


def test_the_arm_that_is_drawn_back_in_a_pause_is_in_no_ones_way() -> None:
    run_input = paused_run_input()
    motion = TableMotion(run_input.plan, Limits())
    record = execute(TableClient(_at(motion.start_deg), timeout_s=0.5), motion, Limits(), Wire())
    there = round(float(run_input.plan.angles_deg[9])) % 360
    across: Callable[[int, int], ConfigurationMap] = lambda first, last: blocks_map(  # noqa: E731 - short
        16, 360, [(first, last, there + 20, there + 25)]
    )
    assert judge_dead_line(across(9, 10), motion, record).forbidden_moments == 0


def _at(angle_deg: float) -> FaultyPort:
    port = FaultyPort()
    bring_to(TableClient(port, timeout_s=0.5), round(angle_deg, 1), Limits(), Wire())
    return port


def test_a_run_without_commands_has_no_moments() -> None:
    motion = steady_motion()
    verdict = judge_dead_line(ConfigurationMap(np.ones((21, 360))), motion, Record())
    assert (verdict.moments, verdict.longest_deg) == (0, 0.0)
