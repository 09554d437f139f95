"""`python -m planner run`: execute a plan on the table at a port, and verify the motion."""

import argparse
import sys

from planner.commands import options
from planner.defaults import REPORT_FILE
from planner.errors import PlannerError
from planner.execution.run import RunOptions, run_plan
from planner.execution.run_verification import RunVerification
from protocol import TableError
from protocol.program.color import colored
from protocol.program.progress import progress_line

_DEVIATED, _NOT_RUN = 1, 2


def run(arguments: argparse.Namespace) -> int:
    """Execute the plan, write the results, print the verdict, and return the exit status."""
    asked = run_options(arguments)
    show = progress_line("run", sys.stderr)
    try:
        checked, duration = run_plan(arguments.plan, arguments.out, asked, arguments.map, show, arguments.command_line)
    except TableError as error:
        raise PlannerError(str(error)) from error
    except OSError as error:
        raise PlannerError(f"{arguments.out}: cannot write the run ({error.strerror or error})") from error
    sys.stdout.write(summary(checked))
    sys.stderr.write(f"{duration}\nthe report is {arguments.out / REPORT_FILE}\n")
    if checked.failure is not None:
        sys.stderr.write(f"the data recorded so far is in {arguments.out}\n")
    return status_of(checked)


def status_of(checked: RunVerification) -> int:
    """Return the exit status that a run comes to."""
    if checked.is_verified:
        return 0
    return _DEVIATED if checked.failure is None or checked.has_strayed else _NOT_RUN


def run_options(arguments: argparse.Namespace) -> RunOptions:
    """Return how a motion is run, from the options of a command."""
    return RunOptions(
        port=options.fresh_table(arguments.port, decimals=arguments.decimals),
        baud=arguments.baud,
        decimals=arguments.decimals,
        timeout_s=arguments.timeout,
        lead_s=arguments.lead,
        run_on_deg=arguments.run_on,
        lag_s=arguments.lag,
        tolerance_deg=arguments.tolerance,
        control=arguments.control,
        arm_is_away=arguments.arm_away,
        time_scale=arguments.time_scale,
    )


def summary(checked: RunVerification) -> str:
    """Return verdict and figures of a run, as text for stdout."""
    lines = [
        colored(checked.verdict, "good" if checked.is_verified else "bad", sys.stdout),
        *(
            f"{name:10} {each.at_locations_deg:.4f} deg off at the locations, {each.anywhere_deg:.4f} anywhere"
            for name, each in checked.deviations.items()
        ),
        f"map        {len(checked.forbidden_steps)} steps touched a forbidden cell; {checked.margin_deg:.2f} deg left",
        f"cost       planned {checked.planned_cost.total:.4f}"
        + (f", executed {checked.executed_cost.total:.4f}" if checked.executed_cost else ""),
        f"commands   maximum delay {1000.0 * checked.latest_command_s:.1f} ms",
        f"dead line  {checked.dead_line}",
    ]
    return "\n".join(lines) + "\n"
