"""A path tracked on the table at a port, from the first view to the output files."""

import gc
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path
from typing import NamedTuple

import numpy as np

from planner.cell.scan import Scan
from planner.defaults import RECEDING
from planner.execution.clear_path import nearest_turns, turns_to_start
from planner.execution.execute import Settings, bring_to, execute_commands, resting_deg
from planner.execution.robot_motion import robot_motion
from planner.execution.run import Duration, RunOptions
from planner.execution.run_file import (
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
from planner.map.config_map import ConfigurationMap
from planner.map.map_file import MAP_FILE, save_maps
from planner.map.map_problem import map_problem
from planner.plans.plan_file import PLAN_FILE, plan_document, save_plan
from planner.table.wire import Wire
from planner.tracking.live_commands import LiveCommands, reveal_first_view
from planner.tracking.pose_source import PathSource, PoseSource, program_source
from planner.tracking.price import Price, price_of_not_knowing
from planner.tracking.track_file import TRACK_RESULTS, save_track
from planner.tracking.track_plots import plot_track
from planner.tracking.track_record import TrackRecord
from planner.tracking.tracked_plan import tracked_plan
from planner.tracking.tracker import Start, Tracker, TrackError, TrackSettings
from protocol import TableClient
from protocol.bench import bench_of
from protocol.clock import WallClock
from protocol.control_channel import ControlChannel
from protocol.program.progress import Progress, ProgressOf

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
        price: the cost against full knowledge.
        duration: how long it took.
        record: what was decided.
        tracker: who decided.
    """

    checked: RunVerification
    price: Price
    duration: Duration
    record: TrackRecord
    tracker: Tracker


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
        TableError: the table did not reply, or did not reach the start.
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
        job = _Job(scan, out, options, wire, tracker, source, tracker.choose_start())
        return _tracked(job, progress_of("track"))


class _Job(NamedTuple):
    """A scan whose first view is known."""

    scan: Scan
    out: Path
    options: TrackOptions
    wire: Wire
    tracker: Tracker
    source: PoseSource
    start: Start


def _tracked(job: _Job, progress: Progress | None) -> Finished:
    """Bring the table to the start, track, and write what happened."""
    run, tracker, limits = job.options.run, job.tracker, job.scan.limits
    port = open_port(run.port, run.baud, run.timeout_s, run.time_scale)
    with ExitStack() as stack:
        with TableClient(port, run.timeout_s * run.time_scale, run.decimals) as table:
            view = bench_of(port) if run.control is None else ControlChannel(run.control, CONTROL_TIMEOUT_S)
            began_s, wall_began_s = table.clock.now_s(), time.perf_counter()
            turns = _turns(job.start, resting_deg(table, job.wire), run.arm_is_away)
            known, record = tracker.begin(job.start, turns), Record()
            observer = stack.enter_context(closing(TrackRecord(job.out, tracker.state, tracker.configuration)))
            for column in known:
                observer.revealed(column)
            bring_to(table, tracker.motion.start_deg, limits, job.wire)
            commands = LiveCommands(
                tracker,
                job.source,
                observer,
                lambda: table.clock.now_s() - record.origin_s,
                job.options.wait_s,
                is_real_time=isinstance(table.clock, WallClock | ScaledClock),
            )
            settings = Settings(lag_s=run.lag_s, lead_s=run.lead_s, run_on_deg=run.run_on_deg)
            with _no_garbage_collection():
                execute_commands(table, tracker.motion, commands, job.wire, settings, view, progress, record)
            duration = Duration(table.clock.now_s() - began_s, time.perf_counter() - wall_began_s)
        try:
            return Finished(*_written(job, observer, record), duration, observer, tracker)
        except KeyboardInterrupt as interrupt:
            if record.failure is not None:
                interrupt.add_note(record.failure)
            raise


def _written(job: _Job, observer: TrackRecord, record: Record) -> tuple[RunVerification, Price]:
    """Write the plan that was carried out, verify it as any plan, and write all that is known of the run."""
    if observer.location_count < 2:
        raise TrackError(record.failure or "the scan ended at its first location")
    out, run, tracker = job.out, job.options.run, job.tracker
    problem, plan, motion, scan = tracked_plan(job.scan, tracker, observer)
    save_maps(out / MAP_FILE, {observer.configuration: problem.map})
    save_plan(out / PLAN_FILE, plan_document(scan, problem, plan, motion))
    run_input = load_run_input(out / PLAN_FILE)
    conditions = RunConditions(run.port, job.wire, run.lead_s, run.tolerance_deg, 0, run.pause_times, run.run_on_deg)
    table_motion = TableMotion(run_input.plan, scan.limits, run.pause_times)
    checked = verify_run(run_input, table_motion, record, run.lead_s, run.tolerance_deg)
    save_run(out, run_input, conditions, table_motion, record, checked)
    save_robot(out, robot_motion(table_motion, run_input.joints_deg), record)
    price = price_of_not_knowing(problem, plan)
    save_track(out, job.options.poses or "the scan's path", tracker, observer, price)
    plot_run(StoredRun(run_input, conditions, table_motion, record), checked, out / "run.png")
    title = f"{scan.name}   {job.options.planner}, {job.options.view} columns in view"
    plot_track(problem, plan, observer, title, out)
    return checked, price


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
