"""The tracker without I/O, in simulated time: locations and time go in, commands and joint targets come out."""

import gc
import sys
from dataclasses import replace
from pathlib import Path
from types import FunctionType, ModuleType

import numpy as np
import pytest

from planner.arrays import FloatArray
from planner.cell.scan import load_scan
from planner.execution.run import RunOptions
from planner.execution.run_file import load_run
from planner.execution.stream import reference_states
from planner.execution.table_motion import Phase
from planner.kinematics.arm import Arm
from planner.kinematics.joint_limits import first_joint_fault
from planner.kinematics.value import RatedPoses, UserFactor
from planner.table.motion import Limits
from planner.table.wire import StreamError
from planner.tracking.online_planner import Kind, Step, Why
from planner.tracking.pose_lines import SourceError
from planner.tracking.revealed_map import WindowError
from planner.tracking.track_run import TrackOptions, track_scan
from planner.tracking.tracker import JointTarget, TrackError
from tests.planner.tracking.track_examples import (
    asked,
    begun_tracker,
    cylinder,
    locations,
    new_tracker,
    steps_to_the_end,
    write_scan,
)


def test_a_path_is_tracked_to_its_end_and_the_reference_follows_the_decisions() -> None:
    path, commands = locations(), []
    tracker = begun_tracker(path, view=8)
    ends = [(0.0, tracker.state.angle_deg)]
    while True:
        for T in path[tracker.count : tracker.count + tracker.room]:
            tracker.reveal(T)
        if tracker.count == len(path):
            tracker.end()
        tracked = asked(tracker)
        if tracked is None:
            break
        assert tracker.running is not None
        commands.append(tracker.running)
        if tracked.step is not None:
            ends.append((tracker.motion.decided_s, tracked.step.end.angle_deg))
    times, angles = zip(*ends, strict=True)
    reached = [state.angle_deg for state in reference_states(commands, times)]
    assert np.abs(np.subtract(reached, angles)).max() < 0.05
    assert tracker.state.location == len(path) - 1
    assert tracker.state.is_at_rest
    assert tracker.missed == 0


def test_the_reference_follows_between_the_locations_too_where_steps_are_long() -> None:
    """The target of a command brakes the table only after the next one would be late; the next one counts on that."""
    path, step_s, commands = locations(47)[::2], 1.5, []
    tracker = begun_tracker(path, limits=Limits(30.0, 15.0), step_s=step_s)
    times: list[float] = []
    decided: list[float] = []
    while True:
        for T in path[tracker.count : tracker.count + tracker.room]:
            tracker.reveal(T)
        if tracker.count == len(path):
            tracker.end()
        tracked = asked(tracker)
        if tracked is None:
            break
        assert tracker.running is not None
        commands.append(tracker.running)
        if tracked.step is not None and tracked.step.kind is Kind.SCAN:
            sampled = tracker.motion.decided_s - step_s * np.linspace(0.9, 0.0, 10)
            times += sampled.tolist()
            decided += [tracker.motion.state_at(time_s).angle_deg for time_s in sampled.tolist()]
    reached = [state.angle_deg for state in reference_states(commands, times)]
    assert np.abs(np.subtract(reached, decided)).max() < 0.1


def test_the_arm_is_obeyed_and_its_targets_come_with_the_steps() -> None:
    path = locations()
    tracker = begun_tracker(path, view=8)
    targets: list[JointTarget] = []
    while (tracked := asked(tracker)) is not None:
        for T in path[tracker.count : tracker.count + tracker.room]:
            tracker.reveal(T)
        if tracker.count == len(path):
            tracker.end()
        targets += tracked.targets
    scanned = [target for target in targets if target.phase is Phase.SCAN]
    assert [target.location for target in scanned] == list(range(1, len(path)))
    joints_deg = np.array([target.joints_deg for target in scanned])
    assert len(scanned) == len(targets)
    assert first_joint_fault(cylinder().cell.arm, joints_deg, cylinder().path.step_s) is None
    joints = cylinder().cell.arm.joints(joints_deg)
    angles = [tracker.motion.state_at(target.time_s).angle_deg for target in scanned[-3:]]
    for k, angle in zip((-3, -2, -1), angles, strict=True):
        wanted = (
            cylinder().cell.table_factors(np.array([angle]))[0] @ cylinder().cell.location_factors(path[k][None])[0]
        )
        np.testing.assert_allclose(cylinder().cell.arm.flange_poses(joints[k][None])[0], wanted, atol=1e-6)


def joints_deg_of(steps: list[Step], arm: Arm) -> FloatArray:
    """Return the robot's own angles (n + 1, 6) along steps."""
    states = [steps[0].start, *(step.end for step in steps if step.kind is not Kind.WAIT)]
    return arm.robot_deg(np.array([state.joints for state in states]))


def test_an_arm_too_slow_for_the_cheapest_steps_is_obeyed() -> None:
    path, arm, step_s = locations(), cylinder().cell.arm, cylinder().path.step_s
    free = joints_deg_of(steps_to_the_end(begun_tracker(path), path), arm)
    fastest_deg_s = np.abs(np.diff(free, axis=0)).max(axis=0) / step_s
    slow = replace(arm, max_speed_deg_s=tuple((0.7 * fastest_deg_s).tolist()))
    steps = steps_to_the_end(begun_tracker(path, arm=slow), path)
    paused = [step.start.location for step in steps if step.kind is Kind.PAUSE]
    assert first_joint_fault(slow, free, step_s) is not None
    assert first_joint_fault(slow, joints_deg_of(steps, slow), step_s, paused) is None


def test_a_decision_that_is_late_is_not_taken_and_counted() -> None:
    tracker = begun_tracker(locations(), view=8)
    for _ in range(4):
        asked(tracker)
    late = tracker.next(tracker.motion.decided_s)
    assert late is not None
    assert late.step is not None
    assert late.step.why is Why.NOT_IN_TIME
    assert tracker.missed == 1


def test_no_step_and_no_way_to_rest_needs_more_than_the_protocol_can_send() -> None:
    """Of 0.39 deg/s2, with one decimal 0.3 can be sent: a table that brakes at its limit needs a third more."""
    path = locations()
    tracker = begun_tracker(path, limits=Limits(30.04, 0.39))
    steps = steps_to_the_end(tracker, path)
    rates = [abs(step.acceleration_deg_s2) for step in steps]
    rates += [abs(kept.acceleration_deg_s2) for step in steps for kept in step.kept]
    assert 0.25 < max(rates) <= 0.3 + 1e-9


def test_when_the_source_dies_the_table_comes_to_rest_before_the_fault_is_raised() -> None:
    tracker = begun_tracker(locations(), view=8)
    for _ in range(6):
        asked(tracker)
    speed_deg_s = tracker.state.speed_deg_s
    tracker.abandon(SourceError("gone"))
    with pytest.raises(SourceError, match="gone"):
        steps_to_the_end(tracker, locations()[: tracker.count])
    assert tracker.state.is_at_rest
    assert speed_deg_s != 0.0
    assert tracker.missed == 0


def test_what_the_encoder_reads_moves_the_reference_and_the_next_commands_bring_it_back() -> None:
    tracker = begun_tracker(locations(), view=8)
    for _ in range(5):
        asked(tracker)
        running = tracker.running
        assert running is not None
        for share in (0.3, 0.6):
            time_s = running.time_s + share * running.leg.duration_s
            tracker.encoder_read(time_s + 0.0035, running.reference_at(time_s).angle_deg + 0.4)
    asked(tracker)
    assert len(tracker.corrections) >= 1
    assert tracker.corrections[0].slip_deg == pytest.approx(0.4, abs=0.25)


def test_a_location_ahead_of_the_window_or_after_the_end_is_refused() -> None:
    tracker = begun_tracker(locations(), view=8)
    with pytest.raises(WindowError, match="the window ends at location 8"):
        tracker.reveal(locations()[9])
    tracker.end()
    with pytest.raises(WindowError, match="the path has ended"):
        tracker.reveal(locations()[9])


def test_a_step_too_short_for_the_line_is_refused_with_one_that_fits() -> None:
    with pytest.raises(StreamError, match=r"a step lasts 50 ms; a time step of 0\.0[0-9] s would fit"):
        new_tracker(step_s=0.05)


def test_a_first_view_that_is_blocked_is_named() -> None:
    tracker = new_tracker()
    far = np.tile(np.eye(4), (2, 1, 1))
    far[:, 0, 3] = 4000.0, 4001.0
    for T in far:
        tracker.reveal(T)
    with pytest.raises(TrackError, match=r"location 0 has no table angle .* out of reach"):
        tracker.choose_start()


def test_a_location_out_of_reach_ends_the_scan_at_rest_before_it() -> None:
    path = locations().copy()
    path[12, 0, 3] = 4000.0
    tracker = begun_tracker(path, view=8)
    with pytest.raises(TrackError, match=r"location 12 has no table angle .* out of reach; no configuration serves"):
        steps_to_the_end(tracker, path)
    assert tracker.state.location == 11
    assert tracker.state.is_at_rest


def deep_size(root: object) -> int:
    """Return the bytes of everything that an object holds, modules, classes and functions left out."""
    seen: set[int] = set()
    waiting, size = [root], 0
    while waiting:
        each = waiting.pop()
        if id(each) in seen or isinstance(each, type | ModuleType | FunctionType):
            continue
        seen.add(id(each))
        size += each.nbytes if isinstance(each, np.ndarray) else sys.getsizeof(each)
        waiting += gc.get_referents(each)
    return size


def test_a_source_of_thousands_of_locations_needs_no_more_memory_than_one_of_a_hundred() -> None:
    path = locations(60)
    tracker = begun_tracker(path, view=5)
    sizes = []
    for k in range(6, 600):
        if tracker.room and k % 50 > 10:
            # Back and forth along the path, with stalls.
            tracker.reveal(path[abs((k % 118) - 59)])
        asked(tracker)
        if k % 100 == 99:
            sizes.append(deep_size(tracker))
    assert sizes[-1] < 1.1 * sizes[0]
    assert tracker.motion.decided_s == tracker.motion.ticks * cylinder().path.step_s
    assert tracker.state.location > 300


def test_a_location_that_another_configuration_reaches_is_reached_by_a_pause_where_that_is_allowed(
    tmp_path: Path,
) -> None:
    def late(poses: RatedPoses) -> FloatArray:
        """Allow NOFLIP at the first 12 locations, and FLIP from there on."""
        return np.where((poses.joints[:, 4] > 0.0) == (poses.locations < 12), 1.0, 0.0)

    def quiet(_: str) -> None:
        """Print nothing."""

    scan = load_scan(write_scan(tmp_path))
    scan = replace(scan, value=replace(scan.value, user_factors=(UserFactor("late", late),)))
    run = RunOptions("emulator://", arm_is_away=True)
    options = TrackOptions(run, view=8, angle_count=72, configuration="best")
    refused = track_scan(scan, tmp_path / "refused", options, quiet, lambda _: None)
    assert "location 12 has no table angle" in refused.checked.verdict
    assert "-FLIP would serve; allow that with --reconfigure" in refused.checked.verdict
    allowed = track_scan(scan, tmp_path / "out", options._replace(reconfigure=True), quiet, lambda _: None)
    assert allowed.checked.is_verified
    assert allowed.tracker.reconfigurations == 1
    stored = load_run(tmp_path / "out").run_input.plan
    assert [(pause.step, pause.configuration) for pause in stored.pauses if pause.configuration] == [
        (11, allowed.tracker.configuration.label)
    ]
    assert allowed.tracker.configuration.flip
    assert not allowed.record.configuration.flip
