"""A path tracked on the table at a port, from the first view to the files that tell of it."""

import gc
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from planner.cell.scan import Scan
from planner.cell.scan_path import ScanPath
from planner.defaults import RECEDING
from planner.execution.clear_path import nearest_turns, turns_to_start
from planner.execution.execute import Settings, bring_to, execute_commands, resting_deg
from planner.execution.robot_motion import robot_motion
from planner.execution.run import Duration, RunOptions
from planner.execution.run_file import (
    PLAN_FILE,
    RUN_RESULTS,
    RunConditions,
    StoredRun,
    save_robot,
    save_run,
)
from planner.execution.run_input import load_run_input
from planner.execution.run_plots import plot_run
from planner.execution.run_record import Record
from planner.execution.run_verification import RunVerification, verify_run
from planner.execution.table_motion import PauseTimes, TableMotion
from planner.execution.table_port import CONTROL_TIMEOUT_S, ScaledClock, open_port
from planner.kinematics.configuration import Configuration
from planner.kinematics.joint_path import joint_speeds_deg_s
from planner.map.config_map import ConfigurationMap
from planner.map.map_file import MAP_FILE, save_maps
from planner.map.map_problem import map_problem
from planner.planning.arm_motion import ArmMotion
from planner.planning.arm_on_path import arm_on_path
from planner.planning.plan import Plan, make_plan
from planner.planning.plan_file import plan_document, save_plan
from planner.planning.problem import Problem
from planner.table.wire import Wire
from planner.tracking.live_commands import LiveCommands, reveal_first_view
from planner.tracking.online_planner import State
from planner.tracking.pose_source import PathSource, PoseSource, program_source
from planner.tracking.price import Price, price_of_not_knowing
from planner.tracking.track_file import TRACK_RESULTS, save_track
from planner.tracking.track_plots import plot_track
from planner.tracking.track_record import TrackRecord
from planner.tracking.tracker import Start, Tracker, TrackError, TrackSettings
from protocol import TableClient
from protocol.bench import bench_of
from protocol.clock import WallClock
from protocol.control_channel import ControlChannel
from protocol.progress import ProgressOf

RESULTS = (*RUN_RESULTS, PLAN_FILE, MAP_FILE, *TRACK_RESULTS)


class TrackOptions(NamedTuple):
    """How a path is tracked; see the options of `python -m planner track`.

    Attributes:
        run: how the table is run.
        poses: where locations come from: None for the scan's own path, else see `program_source`.
        planner: `receding` or `ray_shooting`.
        view: columns that are known ahead of the table.
        configuration: of the arm, or `best`.
        angle_count: table angles of a column.
        reconfigure: whether a pause may change the arm's configuration.
        wait_s: how long to wait for a location.
    """

    run: RunOptions
    poses: str | None = None
    planner: str = RECEDING
    view: int = 50
    configuration: str = "best"
    angle_count: int = 360
    reconfigure: bool = False
    wait_s: float = 60.0


class Finished(NamedTuple):
    """What tracking came to.

    Attributes:
        checked: the run, verified against what was decided.
        duration: how long it took.
        record: what was decided.
        tracker: who decided.
        price: the cost against full knowledge.
    """

    checked: RunVerification
    duration: Duration
    record: TrackRecord
    tracker: Tracker
    price: Price


def track_scan(
    scan: Scan, out: Path, options: TrackOptions, say: Callable[[str], None], progress_of: ProgressOf
) -> Finished:
    """Track a scan's path on the table at a port, write what happened to `out`, and return what it came to.

    Args:
        scan: cell, limits, weights and time step; its path, unless locations come from a program.
        out: the folder.
        options: how.
        say: called with a line for people.
        progress_of: gives the progress of a kind of work.

    Raises:
        PlannerError: there is nothing to begin with; nothing has moved.
        TableError: the table could not be reached, or not be brought to the start.
        OSError: the folder cannot be written.
    """
    problem = map_problem(scan, progress_of("distance field"))
    asked = options.configuration
    configurations = list(Configuration) if asked == "best" else [Configuration.parse(asked)]
    options = options._replace(run=options.run._replace(pause_times=_with_time_for_the_arm(options.run, scan)))
    run = options.run
    wire = Wire(run.decimals, run.baud)
    settings = TrackSettings(
        options.planner,
        options.view,
        reconfigure=options.reconfigure,
        pause_times=run.pause_times,
        run_on_deg=run.run_on_deg,
        lag_s=run.lag_s,
        lead_s=run.lead_s,
    )
    tracker = Tracker(
        problem, scan.path.step_s, scan.limits, scan.weights, wire, settings, configurations, options.angle_count
    )
    out.mkdir(parents=True, exist_ok=True)
    with _source(scan, options, say) as source:
        reveal_first_view(tracker, source, options.wait_s, progress_of("first view"))
        start = tracker.choose_start()
        return _on_the_table(scan, out, options, tracker, source, start, wire, progress_of)


def _on_the_table(
    scan: Scan, out: Path, options: TrackOptions, tracker: Tracker, source: PoseSource, start: Start, wire: Wire,
    progress_of: ProgressOf,
) -> Finished:  # fmt: skip
    run, limits = options.run, scan.limits
    port = open_port(run.port, run.baud, run.timeout_s, run.time_scale)
    with TableClient(port, run.timeout_s * run.time_scale, run.decimals) as table:
        view = bench_of(port) if run.control is None else ControlChannel(run.control, CONTROL_TIMEOUT_S)
        began_s, wall_began_s = table.clock.now_s(), time.perf_counter()
        turns = _turns(start, resting_deg(table, wire), run.arm_is_away)
        known = tracker.begin(start, turns)
        observer = TrackRecord(out, State(0, start.angle_deg + 360.0 * turns, 0.0, start.joints))
        for column in known:
            observer.revealed(column)
        bring_to(table, tracker.motion.start_deg, limits, wire)
        record = Record()
        is_real_time = isinstance(table.clock, WallClock | ScaledClock)
        commands = LiveCommands(
            tracker, source, observer, lambda: table.clock.now_s() - record.origin_s, options.wait_s, is_real_time
        )
        settings = Settings(lag_s=run.lag_s, lead_s=run.lead_s, run_on_deg=run.run_on_deg)
        with _no_garbage_collection():
            execute_commands(table, tracker.motion, commands, wire, settings, view, progress_of("track"), record)
        duration = Duration(table.clock.now_s() - began_s, time.perf_counter() - wall_began_s)
    conditions = RunConditions(
        run.port, wire, run.lead_s, run.tolerance_deg, turns=0, pause_times=run.pause_times, run_on_deg=run.run_on_deg
    )
    try:
        checked, price = _written(scan, out, conditions, tracker, observer, record, options)
    except KeyboardInterrupt as interrupt:
        if record.failure is not None:
            interrupt.add_note(record.failure)
        raise
    return Finished(checked, duration, observer, tracker, price)


def _written(
    scan: Scan, out: Path, conditions: RunConditions, tracker: Tracker, observer: TrackRecord, record: Record,
    options: TrackOptions,
) -> tuple[RunVerification, Price]:  # fmt: skip
    """Write the plan that was carried out, verify it as any plan, and write all that is known of the run."""
    if observer.location_count < 2:
        raise TrackError(record.failure or "the scan ended at its first location")
    problem, plan, motion, tracked_scan = _plan(scan, tracker, observer)
    save_maps(out / MAP_FILE, {tracker.configuration: problem.map})
    save_plan(out / PLAN_FILE, plan_document(tracked_scan, problem, plan, motion))
    run_input = load_run_input(out / PLAN_FILE)
    table_motion = TableMotion(run_input.plan, scan.limits, conditions.pause_times)
    checked = verify_run(run_input, table_motion, record, conditions.lead_s, conditions.tolerance_deg)
    stored = StoredRun(run_input, conditions, table_motion, record)
    save_run(out, run_input, conditions, table_motion, record, checked)
    save_robot(out, robot_motion(table_motion, run_input.joints_deg), record)
    price = price_of_not_knowing(problem, plan)
    save_track(out, options.poses or "the scan's path", tracker, observer, price)
    plot_run(stored, checked, out / "run.png")
    plot_track(problem, plan, observer, f"{scan.name}   {options.planner}, {options.view} columns in view", out)
    return checked, price


def _plan(scan: Scan, tracker: Tracker, observer: TrackRecord) -> tuple[Problem, Plan, ArmMotion, Scan]:
    """Return the plan that was carried out, as if it had been made at once, with its problem and its arm."""
    T_WS = np.stack(observer.T_WS[: observer.location_count])
    scan = replace(scan, predefined_path=ScanPath(T_WS, scan.path.step_s))
    values, reasons = observer.columns()
    configuration = tracker.configuration
    metadata = dict(tracker.map_metadata(T_WS)) | {"configuration": configuration.label}
    map_ = ConfigurationMap(values, reasons, metadata=metadata)
    arm = arm_on_path(scan, configuration)
    angles, speeds, accelerations = observer.motion()
    problem = Problem(map_, scan.path.step_s, scan.limits, scan.weights, float(angles[0]), 0.0, arm)
    plan = make_plan(problem, tracker.settings.planner, angles, speeds, accelerations, observer.pauses)
    plan = replace(plan, waits=observer.waits)
    joints = observer.joints()
    joint_speeds = joint_speeds_deg_s(joints, scan.path.step_s)
    joint_speeds[[pause.step + 1 for pause in plan.pauses]] = 0.0
    central, _ = arm.solve(np.array([0]), angles[:1])
    turns = np.rint((joints[0] - central[0]) / (2.0 * np.pi)).astype(np.int64)
    return problem, plan, ArmMotion(arm.arm, joints, joint_speeds, turns), scan


def _turns(start: Start, position_deg: float, arm_is_away: bool) -> int:
    """Return the full turns of the start at which it is reached from where the table stands."""
    if arm_is_away:
        return nearest_turns(position_deg, start.angle_deg)
    first = ConfigurationMap(start.column.values[np.newaxis])
    return turns_to_start(first, position_deg, start.angle_deg)


def _with_time_for_the_arm(run: RunOptions, scan: Scan) -> PauseTimes:
    """Return the times of a pause in which any joint can turn through all of its range."""
    arm = scan.cell.arm
    ranges_deg = np.subtract(arm.upper_deg, arm.lower_deg)
    needed_s = float(np.max(ranges_deg / np.asarray(arm.max_speed_deg_s)))
    return run.pause_times._replace(rotate_s=max(run.pause_times.rotate_s, needed_s))


@contextmanager
def _source(scan: Scan, options: TrackOptions, say: Callable[[str], None]) -> Iterator[PoseSource]:
    if options.poses is None:
        yield PathSource(scan.path.T_WS)
        return
    with program_source(options.poses, say, options.wait_s) as source:
        yield source


@contextmanager
def _no_garbage_collection() -> Iterator[None]:
    """Keep the search for cyclic garbage, which takes milliseconds, out of a motion."""
    was_enabled = gc.isenabled()
    gc.collect()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()
