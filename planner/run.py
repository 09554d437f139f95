"""A plan file carried out and verified, from the check before the first byte to the files that tell of it."""

from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import NamedTuple

from planner.execute import Settings, bring_to, execute
from planner.free_way import check_ends, nearest_turns, turns_to_start
from planner.inside_view import ControlView, InsideView, view_of
from planner.map_file import MAP_FILE
from planner.robot_motion import robot_motion
from planner.run_file import RunConditions, StoredRun, copy_input, save_robot, save_run
from planner.run_input import load_run_input
from planner.run_plots import plot_run
from planner.run_verification import DEFAULT_TOLERANCE_DEG, RunVerification, verify_run
from planner.stream import check_it_fits, stream
from planner.table_motion import PauseTimes, TableMotion
from planner.table_port import open_port
from planner.wire import Wire
from protocol import TableClient


class RunOptions(NamedTuple):
    """How a plan is run; see the options of `python -m planner run`."""

    port: str
    baud: int = 9600
    decimals: int = 1
    timeout_s: float = 1.0
    lead_s: float = Settings().lead_s
    tolerance_deg: float = DEFAULT_TOLERANCE_DEG
    control: Path | None = None
    arm_is_away: bool = False
    time_scale: float = 1.0
    pause_times: PauseTimes = PauseTimes()


def run_plan(
    plan_file: Path,
    out: Path,
    options: RunOptions,
    map_file: Path | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> RunVerification:
    """Carry a plan out on the table at a port, write what happened to `out`, and return what it came to.

    Raises:
        PlannerError: the plan must not, or cannot, be run; nothing has moved.
        TableError: the table could not be reached, or not be brought to the start.
        OSError: the folder cannot be written.
    """
    map_file = map_file or plan_file.with_name(MAP_FILE)
    run_input = load_run_input(plan_file, map_file)
    limits, wire = run_input.problem.limits, Wire(options.decimals, options.baud)
    motion = TableMotion(run_input.plan, limits, options.pause_times)
    check_ends(run_input.problem.map, motion)
    check_it_fits(stream(motion, limits, wire), wire)
    out.mkdir(parents=True, exist_ok=True)
    copy_input(out, plan_file, map_file)
    with ExitStack() as stack:
        port = open_port(options.port, options.baud, options.timeout_s, options.time_scale)
        timeout_s = options.timeout_s * options.time_scale
        table = stack.enter_context(TableClient(port, timeout_s, options.decimals))
        view = _view(options.control, port, stack)
        position_deg = table.position_deg()
        if options.arm_is_away:
            turns = nearest_turns(position_deg, motion.start_deg)
        else:
            turns = turns_to_start(run_input.problem.map, position_deg, motion.start_deg)
        run_input = run_input.turned(turns)
        motion = TableMotion(run_input.plan, limits, options.pause_times)
        bring_to(table, motion.start_deg, limits, wire)
        settings = Settings(lead_s=options.lead_s)
        record = execute(table, motion, limits, wire, settings, view, progress)
    conditions = RunConditions(options.port, wire, options.lead_s, options.tolerance_deg, turns, options.pause_times)
    checked = verify_run(run_input, motion, record, options.lead_s, options.tolerance_deg)
    save_run(out, run_input, conditions, motion, record, checked)
    save_robot(out, robot_motion(motion, run_input.joints_deg), record)
    plot_run(StoredRun(run_input, conditions, motion, record), checked, out / "run.png")
    return checked


def _view(control: Path | None, port: object, stack: ExitStack) -> InsideView | None:
    if control is None:
        return view_of(port)
    view = ControlView(control)
    stack.callback(view.close)
    return view
