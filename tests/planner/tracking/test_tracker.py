"""The tracker without I/O, in simulated time: locations and time go in, commands and joint targets come out."""

import tracemalloc

import numpy as np
import pytest

from planner.execution.stream import reference_states
from planner.execution.table_motion import Phase
from planner.kinematics.joint_limits import first_joint_fault
from planner.table.wire import StreamError, Wire
from planner.tracking.online_planner import Kind, Why
from planner.tracking.pose_lines import SourceError
from planner.tracking.revealed_map import WindowError
from planner.tracking.tracker import TrackError
from tests.planner.tracking.track_examples import (
    asked,
    begun_tracker,
    cylinder,
    locations,
    new_tracker,
    steps_to_the_end,
)


def test_a_path_is_tracked_to_its_end_and_the_reference_follows_the_decisions() -> None:
    path, commands, ends = locations(), [], [(0.0, 0.0)]
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


def test_the_arm_is_obeyed_and_its_targets_come_with_the_steps() -> None:
    path = locations()
    tracker = begun_tracker(path, view=8)
    targets = []
    while (tracked := asked(tracker)) is not None:
        for T in path[tracker.count : tracker.count + tracker.room]:
            tracker.reveal(T)
        if tracker.count == len(path):
            tracker.end()
        targets += tracked.targets
    scanned = [target for target in targets if target.phase is Phase.SCAN]
    assert [target.location for target in scanned] == list(range(1, len(path)))
    joints_deg = np.array([target.joints_deg for target in scanned])
    paused = [k for k, target in enumerate(targets) if target.phase is Phase.RETRACT]
    assert not paused
    assert first_joint_fault(cylinder().cell.arm, joints_deg, cylinder().path.step_s) is None
    joints = cylinder().cell.arm.joints(joints_deg)
    goals = cylinder().cell.goal_flange_poses(path, np.zeros(1))
    angles = [tracker.motion.state_at(target.time_s).angle_deg for target in scanned[-3:]]
    for k, angle in zip((-3, -2, -1), angles, strict=True):
        wanted = (
            cylinder().cell.table_factors(np.array([angle]))[0] @ cylinder().cell.location_factors(path[k][None])[0]
        )
        np.testing.assert_allclose(cylinder().cell.arm.flange_poses(joints[k][None])[0], wanted, atol=1e-6)
    assert goals.shape[0] == len(path)


def test_an_arm_too_slow_for_a_step_makes_the_table_take_another() -> None:
    tracker = begun_tracker(locations(), view=8)
    joint_speeds = [
        np.abs(np.subtract(step.end.joints, step.start.joints)).max()
        for step in steps_to_the_end(tracker, locations())
        if step.kind is Kind.SCAN and step.end.joints is not None and step.start.joints is not None
    ]
    assert np.degrees(max(joint_speeds)) / cylinder().path.step_s < max(cylinder().cell.arm.max_speed_deg_s)


def test_a_decision_that_is_late_is_not_taken_and_counted() -> None:
    tracker = begun_tracker(locations(), view=8)
    for _ in range(4):
        asked(tracker)
    late = tracker.next(tracker.motion.decided_s)
    assert late is not None
    assert late.step is not None
    assert late.step.why is Why.NOT_IN_TIME
    assert tracker.missed == 1


def test_when_the_source_dies_the_table_comes_to_rest_before_the_fault_is_raised() -> None:
    tracker = begun_tracker(locations(), view=8)
    for _ in range(6):
        asked(tracker)
    assert not tracker.state.is_at_rest
    tracker.abandon(SourceError("gone"))
    with pytest.raises(SourceError, match="gone"):
        while True:
            asked(tracker)
    assert tracker.state.is_at_rest
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
        new_tracker(Wire(), step_s=0.05)


def test_a_first_view_that_is_blocked_is_named() -> None:
    tracker = new_tracker()
    far = np.tile(np.eye(4), (2, 1, 1))
    far[:, 0, 3] = 4000.0, 4001.0
    for T in far:
        tracker.reveal(T)
    with pytest.raises(TrackError, match="location 0 has no table angle .* out of reach"):
        tracker.choose_start()


def test_a_location_out_of_reach_ends_the_scan_at_rest_before_it() -> None:
    path = locations().copy()
    path[12, 0, 3] = 4000.0
    tracker = begun_tracker(path, view=8)
    with pytest.raises(TrackError, match="location 12 has no table angle .* out of reach; no configuration serves"):
        steps_to_the_end(tracker, path)
    assert tracker.state.location == 11
    assert tracker.state.is_at_rest


def test_memory_does_not_grow_with_the_path() -> None:
    path = locations(60)
    tracker = begun_tracker(path, view=5)
    sizes = []
    tracemalloc.start()
    try:
        for k in range(6, 2000):
            if tracker.room:
                # To and fro along the path.
                tracker.reveal(path[abs((k % 118) - 59)])
            asked(tracker)
            if k % 500 == 499:
                sizes.append(tracemalloc.get_traced_memory()[0])
    finally:
        tracemalloc.stop()
    assert sizes[-1] < sizes[0] + 50_000
