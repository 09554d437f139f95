from pathlib import Path

import numpy as np
import pytest

import emulator  # noqa: F401 - teaches pyserial the port emulator://
from planner.execution.table_port import open_port
from planner.scanning.latched_run import LatchedRun, NothingScannedError, ReadingMotion, TriggerConditions, run_latched
from planner.scanning.latching import Drop
from planner.scanning.trigger_line import ProbeByHand, TriggerFaults
from planner.table.wire import Wire
from protocol import Clock, TableClient
from protocol.bench import GroundTruth, TableStatus
from tests.planner.latched import LIMITS, joints_along, latched_run, swinging_plan, table_behind


@pytest.fixture(scope="module")
def sound() -> LatchedRun:
    return latched_run(TriggerConditions())


def test_profiles_come_at_the_probes_rate_and_most_are_paired(sound: LatchedRun) -> None:
    assert sound.failure is None
    assert sound.triggers == pytest.approx(25 * 4.0, abs=3)
    assert np.diff(sound.times_s) == pytest.approx(np.diff(sound.numbers) / 25.0)
    assert len(sound.numbers) + len(sound.dropped) == sound.triggers
    # Three commands and their replies take a period; then one latch in twelve is overwritten before it is read.
    assert len(sound.dropped) <= 0.12 * sound.triggers
    assert set(sound.dropped.values()) <= {Drop.TABLE_UNREAD}


def test_robot_and_table_are_latched_at_the_profile(sound: LatchedRun) -> None:
    assert sound.true_joints_deg[:, 0] == pytest.approx(sound.times_s)
    late_s = sound.joints_deg[:, 0] - sound.times_s
    assert (late_s >= 0.0).all()
    assert (late_s <= 0.0001 + 1e-9).all()
    motion = ReadingMotion(swinging_plan(), LIMITS, 25.0)
    planned = np.array([motion.state_at(time_s).angle_deg for time_s in sound.times_s])
    assert np.abs(sound.true_deg - planned).max() < 0.3
    # Backlash, and half a step of the wire.
    assert np.abs(sound.latched_deg - sound.edge_deg).max() < 10.0 / 60.0 + 0.01
    assert np.abs(sound.angles_deg - sound.latched_deg).max() <= 0.05 + 1e-9


def test_the_same_seed_gives_the_same_run_and_another_one_another(sound: LatchedRun) -> None:
    again, other = latched_run(TriggerConditions()), latched_run(TriggerConditions(seed=1))
    assert (again.joints_deg == sound.joints_deg).all()
    assert (again.angles_deg == sound.angles_deg).all()
    assert (other.joints_deg != sound.joints_deg).any()


OTHER_TABLES = {
    "as shipped": (96, 10.0, 1000),
    "coarse encoder": (24, 10.0, 1000),
    "fine encoder": (120, 10.0, 1000),
    "no backlash": (96, 0.0, 1000),
    "much backlash": (48, 40.0, 1000),
    "coarse and no backlash": (12, 0.0, 1000),
    "slow firmware": (48, 10.0, 500),
}


@pytest.mark.parametrize("name", OTHER_TABLES)
def test_what_is_told_of_a_table_is_that_table_s(name: str, tmp_path: Path) -> None:
    lines, backlash_arcmin, tick_hz = OTHER_TABLES[name]
    config = tmp_path / "table.toml"
    config.write_text(
        f"[encoder]\nlines = {lines}\n[gears]\nbacklash_arcmin = {backlash_arcmin}\n[control]\ntick_hz = {tick_hz}\n"
    )
    run = latched_run(TriggerConditions(rate_hz=40.0), decimals=4, query=f"&config={config}")
    assert run.failure is None
    step_deg = 360.0 / (4 * lines * 480.0)  # four counts per line, before gears of 480:1
    encoder_deg = run.latched_deg - run.shaft_deg
    # Within a tick the shaft is followed by a straight line here, and by a parabola at the latch.
    assert np.abs(encoder_deg).max() <= 0.5 * step_deg + 0.0015
    assert np.std(encoder_deg) == pytest.approx(step_deg / np.sqrt(12.0), rel=0.2, abs=2e-4)
    # The default encoder gives counts of 1/512 deg: the steps of the latch itself are those of this one.
    steps = (run.latched_deg - run.latched_deg[0]) / step_deg
    assert steps == pytest.approx(steps.round(), abs=1e-6)
    gap_deg = run.shaft_deg - run.edge_deg
    half_gap_deg = 0.5 * backlash_arcmin / 60.0
    assert np.abs(gap_deg).max() <= half_gap_deg + 1e-9
    assert np.sqrt(np.mean(gap_deg**2)) >= 0.8 * half_gap_deg  # in contact most of the time
    assert np.abs(run.angles_deg - run.latched_deg).max() <= 0.5e-4 + 1e-9


def test_a_table_that_lags_more_than_the_emulator_loses_no_profile_for_it(tmp_path: Path) -> None:
    slow_loop = tmp_path / "table.toml"
    slow_loop.write_text("[gains.ramp]\nintegral_time_s = 0.025\n[gains.hold]\nintegral_time_s = 0.045\n")
    run = latched_run(TriggerConditions(), swinging_plan(acceleration_deg_s2=39.0), query=f"&config={slow_loop}")
    motion = ReadingMotion(swinging_plan(acceleration_deg_s2=39.0), LIMITS, 25.0)
    off_deg = run.angles_deg - [motion.state_at(time_s).angle_deg for time_s in run.times_s]
    assert np.abs(off_deg).max() > 0.8  # 25 ms behind
    assert set(run.dropped.values()) <= {Drop.TABLE_UNREAD}


def kept_among(sound: LatchedRun, count: int) -> frozenset[int]:
    """Return some profiles that are paired without a fault, taken while the table turns fast."""
    speeds = np.abs(np.gradient(sound.true_deg, sound.times_s))
    return frozenset(sound.numbers[speeds > 8.0][5 :: max(1, int((speeds > 8.0).sum() / count))].tolist())


@pytest.mark.parametrize("fault", TriggerFaults._fields)
def test_a_trigger_fault_drops_at_most_its_own_profiles(sound: LatchedRun, fault: str) -> None:
    hit = kept_among(sound, 3)
    assert len(hit) >= 3
    run = latched_run(TriggerConditions(faults=TriggerFaults(**{fault: hit})))
    dropped = set(run.dropped) - set(sound.dropped)
    assert dropped <= hit
    if fault.endswith("misses"):
        assert dropped == hit
        reason = Drop.ROBOT_MISSED if fault.startswith("robot") else Drop.TABLE_STRAY
        assert {run.dropped[number] for number in hit} == {reason}
    both, here, there = np.intersect1d(run.numbers, sound.numbers, return_indices=True)
    assert len(both) >= len(sound.numbers) - len(hit)
    assert run.joints_deg[here] == pytest.approx(sound.joints_deg[there], abs=2e-4)
    assert run.angles_deg[here] == pytest.approx(sound.angles_deg[there], abs=0.1 + 1e-9)


def test_a_table_that_hears_no_trigger_gives_nothing_and_says_why() -> None:
    deaf = TriggerConditions(faults=TriggerFaults(robot_misses=frozenset(range(1000))))
    with pytest.raises(NothingScannedError, match=r"all \d+ profiles were dropped, mostly because the robot latched"):
        latched_run(deaf)


def test_profiles_are_taken_on_the_path_only(sound: LatchedRun) -> None:
    assert sound.times_s.min() >= 0.0
    assert sound.times_s.max() <= 4.0


class SlowView:
    """A ground truth whose first reading takes long."""

    def __init__(self, table: GroundTruth, clock: Clock, first_look_s: float) -> None:
        self.trigger = table.trigger
        self._table, self._clock, self._delay_s = table, clock, first_look_s

    def status(self) -> TableStatus:
        self._clock.sleep_s(self._delay_s)
        self._delay_s = 0.0
        return self._table.status()


def test_a_look_that_takes_long_does_not_shift_the_profiles_in_time() -> None:
    plan, port = swinging_plan(), open_port("emulator://", 9600, 0.5)
    with TableClient(port, 0.5) as table:
        line = ProbeByHand(SlowView(table_behind(port), table.clock, first_look_s=0.03), table.clock)
        run = run_latched(table, line, plan, joints_along(plan), LIMITS, Wire(), TriggerConditions())
    motion = ReadingMotion(plan, LIMITS, 25.0)
    off_deg = run.angles_deg - np.array([motion.state_at(time_s).angle_deg for time_s in run.times_s])
    # The lag of the speed loop and half a step of the wire; 30 ms would be 0.3 deg.
    assert np.abs(off_deg).max() < 0.15


def test_the_fastest_probe_does_not_hold_the_commands_up() -> None:
    run = latched_run(TriggerConditions(rate_hz=100.0))
    assert run.failure is None
    assert len(run.numbers) > 0.3 * run.triggers
