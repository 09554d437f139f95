"""`python -m planner run`: carry out a plan on the table at a port, and prove that it was carried out."""

import argparse
import sys
from pathlib import Path

from planner.commands import options
from planner.errors import PlannerError
from planner.execution.execute import Settings
from planner.execution.run import RunOptions, run_plan
from planner.execution.run_verification import DEFAULT_TOLERANCE_DEG, RunVerification
from planner.progress import progress_line
from protocol import TableError

_DEVIATED, _NOT_RUN = 1, 2


def add_parser(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command to `python -m planner`."""
    parser = commands.add_parser(
        "run",
        help="carry out a plan on a table, and verify the motion",
        description="Stream a plan to the table at a port; exit status 1 when the motion deviated from the plan.",
        epilog="example: python -m planner run build/cylinder/plan.json --port /dev/ttyUSB0 --out build/cylinder/run",
    )
    parser.add_argument("plan", metavar="PLAN.json", type=Path, help="a plan that python -m planner plan has written")
    parser.add_argument(
        "--port",
        metavar="URL",
        required=True,
        help="a device, socket://HOST:PORT, or emulator:// for a simulated table",
    )
    parser.add_argument(
        "--out", metavar="DIR", type=Path, required=True, help="folder for run.json, run.csv and run.png"
    )
    parser.add_argument("--map", metavar="FILE", type=Path, help="the plan's map (default: map.npz beside the plan)")
    options.add_wire(parser)
    parser.add_argument(
        "--timeout",
        type=options.positive_number,
        default=1.0,
        metavar="S",
        help="wait this long for a reply (default 1)",
    )
    parser.add_argument(
        "--lead", type=options.number(-1.0, 1.0), default=Settings().lead_s, metavar="S",
        help="send commands ahead by the encoder's lag behind the reference: 0.0035 for the stand-in (default 0)",
    )  # fmt: skip
    options.add_lag(parser)
    parser.add_argument(
        "--tolerance", type=options.positive_number, default=DEFAULT_TOLERANCE_DEG, metavar="DEG",
        help="what the encoder may deviate at a location (default %(default)s)",
    )  # fmt: skip
    options.add_run_on(parser)
    parser.add_argument(
        "--arm-away",
        action="store_true",
        help="the arm is drawn back until the table stands at the start: any way there is free",
    )
    options.add_stand_in(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Run the plan, write what happened, print the verdict, and return the exit status."""
    asked = RunOptions(
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
    show = progress_line("run", sys.stderr)
    try:
        checked, duration = run_plan(arguments.plan, arguments.out, asked, arguments.map, show)
    except TableError as error:
        raise PlannerError(str(error)) from error
    except OSError as error:
        raise PlannerError(f"{arguments.out}: the run cannot be written there ({error.strerror or error})") from error
    sys.stdout.write(summary(checked))
    sys.stderr.write(f"{duration}\n")
    if checked.failure is not None:
        sys.stderr.write(f"what was recorded until then is in {arguments.out}\n")
    if checked.is_verified:
        return 0
    return _DEVIATED if checked.failure is None or checked.has_strayed else _NOT_RUN


def summary(checked: RunVerification) -> str:
    """Return what a run came to, for people."""
    lines = [checked.verdict]
    for name, each in checked.deviations.items():
        lines.append(
            f"{name:10} {each.at_locations_deg:.4f} deg off at the locations, {each.anywhere_deg:.4f} anywhere"
        )
    lines += [
        f"map        {len(checked.forbidden_steps)} steps touched a forbidden cell; {checked.margin_deg:.2f} deg left",
        f"cost       planned {checked.planned_cost.total:.4f}"
        + (f", executed {checked.executed_cost.total:.4f}" if checked.executed_cost else ""),
        f"commands   the latest was {1000.0 * checked.latest_command_s:.1f} ms late",
        f"dead line  {checked.dead_line}",
    ]
    return "\n".join(lines) + "\n"
