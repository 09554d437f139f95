"""The execution of a plan file, from the check before the first byte to the verification and the output files."""

import logging
import time
from datetime import datetime
from pathlib import Path
from typing import NamedTuple

import numpy as np

from planner.defaults import REPORT_FILE, RUN_ON_DEG, TOLERANCE_DEG
from planner.execution.clear_path import check_ends, nearest_turns, turns_to_start
from planner.execution.execute import Settings, bring_to, execute, resting_deg
from planner.execution.robot_motion import robot_motion, turning_time_s
from planner.execution.run_file import (
    RUN_RESULTS,
    RunConditions,
    StoredRun,
    copy_input,
    save_robot,
    save_run,
)
from planner.execution.run_input import RunInput, load_run_input
from planner.execution.run_plots import plot_run
from planner.execution.run_report import write_report
from planner.execution.run_verification import RunVerification, verify_run
from planner.execution.stream import check_it_fits, stream
from planner.execution.table_motion import PauseTimes, TableMotion
from planner.execution.table_port import CONTROL_TIMEOUT_S, open_port
from planner.map.map_file import MAP_FILE
from planner.plans.plan_file import PLAN_FILE
from planner.set_aside import set_aside
from planner.table.wire import Wire
from protocol import TableClient
from protocol.bench import bench_of
from protocol.control_channel import ControlChannel
from protocol.program.progress import Progress

_log = logging.getLogger(__name__)


class RunOptions(NamedTuple):
    """Settings for the execution of a plan; see the options of `python -m planner run`."""

    port: str
    baud: int = 9600
    decimals: int = 1
    timeout_s: float = 1.0
    lead_s: float = Settings().lead_s
    run_on_deg: float = RUN_ON_DEG
    lag_s: float = Settings().lag_s
    tolerance_deg: float = TOLERANCE_DEG
    control: Path | None = None
    arm_is_away: bool = False
    time_scale: float = 1.0
    pause_times: PauseTimes = PauseTimes()


class Duration(NamedTuple):
    """The duration of a run: in the time of its port, and in real time."""

    table_s: float
    wall_s: float

    def __str__(self) -> str:
        times_real = self.table_s / self.wall_s
        return f"{self.table_s:.1f} s of table time in {self.wall_s:.2f} s: {times_real:.3g} times real time"


class Finished(NamedTuple):
    """The results of a run, and its duration."""

    checked: RunVerification
    duration: Duration


def run_plan(
    plan_file: Path,
    out: Path,
    options: RunOptions,
    map_file: Path | None = None,
    progress: Progress | None = None,
    command: str = "",
) -> Finished:
    """Execute a plan on the table at a port, write the results to `out`, and return them.

    Args:
        plan_file: the plan.
        out: the folder.
        options: the port, and how the plan is run.
        map_file: the plan's map; by default beside the plan.
        progress: called with the time that has passed and all of it.
        command: the command line that asks for the run, for the report.

    Raises:
        PlannerError: the plan must not or cannot be executed; the table has not moved.
        TableError: the table did not reply, or did not reach the start.
        OSError: the folder cannot be written.
    """
    map_file = map_file or plan_file.with_name(MAP_FILE)
    set_aside(out, (*RUN_RESULTS, PLAN_FILE, MAP_FILE), keep=(plan_file, map_file))
    run_input = load_run_input(plan_file, map_file)
    options = options._replace(pause_times=_with_time_for_the_arm(options.pause_times, run_input))
    limits, wire = run_input.problem.limits, Wire(options.decimals, options.baud)
    motion = run_input.motion(options.pause_times)
    check_ends(run_input.problem.map, motion)
    check_it_fits(stream(motion, limits, wire, options.run_on_deg), wire)
    out.mkdir(parents=True, exist_ok=True)
    port = open_port(options.port, options.baud, options.timeout_s, options.time_scale)
    with TableClient(port, options.timeout_s * options.time_scale, options.decimals) as table:
        simulated = bench_of(port)
        view = simulated if options.control is None else ControlChannel(options.control, CONTROL_TIMEOUT_S)
        begun = None if simulated is not None else datetime.now().astimezone().isoformat(timespec="seconds")
        table_began_s, wall_began_s = table.clock.now_s(), time.perf_counter()
        turns = _turns(run_input, motion, resting_deg(table, wire), options.arm_is_away)
        run_input = run_input.turned(turns)
        motion = run_input.motion(options.pause_times)
        _log.debug("to the start at %.6g deg, %d turn(s) from the plan's", motion.start_deg, turns)
        bring_to(table, motion.start_deg, limits, wire)
        settings = Settings(lag_s=options.lag_s, lead_s=options.lead_s, run_on_deg=options.run_on_deg)
        record = execute(table, motion, limits, wire, settings, view, progress)
        duration = Duration(table.clock.now_s() - table_began_s, time.perf_counter() - wall_began_s)
    conditions = RunConditions(
        options.port, wire, options.lead_s, options.tolerance_deg, turns, options.pause_times, options.run_on_deg, begun
    )
    stored = StoredRun(run_input, conditions, motion, record)
    try:
        return Finished(_written(out, plan_file, map_file, stored, command), duration)
    except KeyboardInterrupt as interrupt:
        if record.failure is not None:
            interrupt.add_note(record.failure)
        raise


def _written(out: Path, plan_file: Path, map_file: Path, stored: StoredRun, command: str) -> RunVerification:
    """Verify a run, write all its data, and return the results."""
    run_input, conditions, motion, record = stored
    checked = verify_run(run_input, motion, record, conditions.lead_s, conditions.tolerance_deg)
    copy_input(out, plan_file, map_file)
    save_run(out, run_input, conditions, motion, record, checked)
    save_robot(out, robot_motion(motion, run_input.joints_deg), record)
    plot_run(stored, checked, out / "run.png")
    write_report(out, out / REPORT_FILE, command)
    return checked


def _with_time_for_the_arm(pause_times: PauseTimes, run_input: RunInput) -> PauseTimes:
    """Return the times of a pause in which every joint can make its maximum turn at its maximum speed."""
    max_speeds_deg_s = np.array(run_input.arm.max_speed_deg_s)
    needed_s = turning_time_s(run_input.plan, run_input.joints_deg, max_speeds_deg_s)
    return pause_times._replace(rotate_s=max(pause_times.rotate_s, needed_s))


def _turns(run_input: RunInput, motion: TableMotion, position_deg: float, arm_is_away: bool) -> int:
    """Return the number of full turns to add to the plan so that its start can be reached."""
    if arm_is_away:
        return nearest_turns(position_deg, motion.start_deg)
    return turns_to_start(run_input.problem.map, position_deg, motion.start_deg)
