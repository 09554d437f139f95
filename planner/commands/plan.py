"""`python -m planner plan`: choose the table's motion along a scan, write it, and print its quality."""

import argparse
import sys
import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from planner.cell.scan import load_scan
from planner.commands import options
from planner.errors import PlannerError
from planner.execution.run_file import RUN_RESULTS
from planner.map.map_file import MAP_FILE
from planner.planning.own_planners import planner_named, planner_names
from planner.planning.scan_planning import PlannedScan, plan_scan
from planner.planning.smoothing import smooth
from planner.plans.arm_motion import ArmMotion, arm_follows
from planner.plans.arm_plots import plot_arm
from planner.plans.plan import NoPlan, Outcome, Plan, Planner
from planner.plans.plan_file import PLAN_FILE
from planner.plans.plan_plots import plot_plan
from planner.plans.problem import Problem
from planner.plans.verification import verify
from planner.plug_ins import PlugInError
from planner.set_aside import set_aside
from protocol.program.progress import progress_line

_NO_PLAN = 1
# A run belongs to its plan: beside another plan, it would be taken for a run of that plan.
PLAN_RESULTS = (PLAN_FILE, "plan.png", "arm.png", MAP_FILE, *RUN_RESULTS)


def run(arguments: argparse.Namespace) -> int:
    """Write plan, map and pictures, print cost, time and margins, and return the exit status."""
    planner = planner_named(arguments.planner)
    set_aside(arguments.out, PLAN_RESULTS)
    scan = load_scan(arguments.scan, options.say, progress_line("mesh", sys.stderr))
    plans = plan_scan(
        scan,
        arguments.configuration,
        arguments.angles,
        timed(smoothed(planner) if arguments.smooth else planner),
        lambda label: progress_line(label, sys.stderr),
        arguments.start,
        compiled=arguments.planner,
    )
    for label, outcome in plans.comparison.outcomes.items():
        sys.stderr.write(configuration_line(label, outcome))
    planned = plans.best
    if planned is None:
        sys.stdout.write(f"{plans.comparison.why_no_plan(scan)}\n")
        return _NO_PLAN
    _write(arguments.out, planned)
    sys.stdout.write(report(planned))
    if arguments.compare:
        start = replace(planned.problem, start_angle_deg=float(planned.plan.angles_deg[0]))
        sys.stdout.write(comparison_table(start, {name: compared(name, start) for name in planner_names()}))
    return 0 if planned.is_executable else _NO_PLAN


def smoothed(planner: Planner) -> Planner:
    """Return the planner followed by smoothing, unless the smoothed plan cannot be followed by the arm."""

    def plan(problem: Problem) -> Outcome:
        outcome = planner(problem)
        if isinstance(outcome, NoPlan):
            return outcome
        smoother = smooth(problem, outcome)
        return smoother if arm_follows(problem, smoother) or not arm_follows(problem, outcome) else outcome

    return plan


def timed(planner: Planner) -> Planner:
    """Return the planner with the computing time in its plans. The first call may compile and is not timed."""

    def plan(problem: Problem) -> Outcome:
        if isinstance(no_plan := planner(problem), NoPlan):
            return no_plan
        before = time.perf_counter()
        outcome = planner(problem)
        seconds = time.perf_counter() - before
        return replace(outcome, computing_time_s=seconds) if isinstance(outcome, Plan) else outcome

    return plan


def configuration_line(label: str, outcome: Outcome) -> str:
    """Return the result for one arm configuration."""
    return f"{label:20} {outcome.reason if isinstance(outcome, NoPlan) else f'cost {outcome.cost.total:.3f}'}\n"


def report(planned: PlannedScan) -> str:
    """Return cost, time and margins of a plan, as text."""
    problem, plan, checked = planned.problem, planned.plan, planned.verification
    cost = plan.cost
    lines = [
        f"{planned.scan.name}: {plan.planner}, {plan.configuration}, {problem.map.location_count} locations, "
        f"{problem.step_count * problem.step_s:g} s",
        f"cost          {cost.total:.4f} = acceleration {cost.acceleration:.4f} + speed {cost.speed:.4f} "
        f"+ value {cost.value:.4f} + pauses {cost.pauses:.4f}",
        f"pauses        {len(plan.pauses)}",
        f"planned in    {1e3 * (plan.computing_time_s or 0.0):.2f} ms",
        f"margins       {checked.clearance_deg:.2f} deg to the nearest forbidden sample, "
        f"{checked.speed_margin_deg_s:.2f} deg/s to the speed limit, "
        f"{checked.acceleration_margin_deg_s2:.2f} deg/s2 to the acceleration limit",
        f"arm           {_arm_verdict(planned.arm)}",
        *_arm_lines(planned.arm),
    ]
    return "\n".join(lines) + "\n"


def _arm_verdict(motion: ArmMotion) -> str:
    if motion.step is None:
        return "follows within joint limits and joint speeds"
    return f"cannot follow at location {motion.step}: {motion.reason.label}"


def _arm_lines(motion: ArmMotion) -> list[str]:
    """Return the start turns of the joints that have more than one turn, and the remaining range of each joint."""
    ranges_deg = np.subtract(motion.arm.upper_deg, motion.arm.lower_deg)
    turns = [
        f"joint {j + 1} at {motion.robot_deg[0, j]:.1f} deg (turn {motion.start_turns[j]:+d})"
        for j in np.flatnonzero(ranges_deg > 360.0)
    ]
    rows = (
        ("joint margins", [f"joint {j}" for j in range(1, 7)]),
        ("  limit, deg", [f"{margin:.1f}" for margin in motion.limit_margins_deg]),
        ("  speed, deg/s", [f"{margin:.1f}" for margin in motion.speed_margins_deg_s]),
    )
    return [
        f"start turns   {', '.join(turns) or 'no joint has more than one turn'}",
        *(f"{name:14}" + "".join(f"{text:>9}" for text in texts) for name, texts in rows),
    ]


def compared(name: str, problem: Problem) -> Outcome | PlugInError:
    """Return the result of a planner. A broken plug-in does not prevent the results of other planners."""
    try:
        return timed(planner_named(name))(problem)
    except PlugInError as error:
        return error


def comparison_table(problem: Problem, outcomes: Mapping[str, Outcome | PlugInError]) -> str:
    """Return a line for each planner: cost, violations, pauses and time, all from the same start angle."""
    lines = [f"{'planner':20} {'cost':>10} {'forbidden steps':>15} {'within limits':>13} {'pauses':>6} {'ms':>9}  arm"]
    for name, outcome in outcomes.items():
        if isinstance(outcome, NoPlan | PlugInError):
            lines.append(f"{name:20} {outcome.reason if isinstance(outcome, NoPlan) else outcome}")
            continue
        checked = verify(problem, outcome)
        lines.append(
            f"{name:20} {outcome.cost.total:10.4f} {len(checked.forbidden_steps):15d} "
            f"{'yes' if checked.within_limits else 'no':>13} {len(outcome.pauses):6d} "
            f"{1e3 * (outcome.computing_time_s or 0.0):9.2f}  "
            f"{'follows' if arm_follows(problem, outcome) else 'cannot follow'}"
        )
    return "\n".join(lines) + "\n"


def _write(out: Path, planned: PlannedScan) -> None:
    try:
        planned.save(out)
        title = f"{planned.scan.name}   {planned.plan.configuration}   {planned.plan.planner}"
        plot_plan(planned.problem, planned.plan, title, out / "plan.png")
        plot_arm(planned.arm, title, out / "arm.png")
    except OSError as error:
        raise PlannerError(f"{out}: cannot write the plan ({error.strerror or error})") from error
