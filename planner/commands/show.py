"""`python -m planner show`: one HTML page of a run."""

import argparse
import sys
from pathlib import Path

from planner.errors import PlannerError
from planner.execution.run_file import load_run
from planner.execution.run_report import run_report
from planner.execution.run_verification import verify_run
from planner.whole_file import write_whole

REPORT_FILE = "report.html"


def add_parser(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command to `python -m planner`."""
    parser = commands.add_parser(
        "show",
        help="show a run as one HTML page",
        description="Write a page that shows a run, with everything in it: map, paths, profile, deviations, commands.",
        epilog="example: python -m planner show build/cylinder/run",
    )
    parser.add_argument("folder", metavar="DIR", type=Path, help="what python -m planner run has written")
    parser.add_argument("--out", metavar="FILE", type=Path, help=f"the page (default: {REPORT_FILE} in DIR)")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Write the page, print its name, and return the exit status."""
    stored = load_run(arguments.folder)
    conditions = stored.conditions
    checked = verify_run(stored.run_input, stored.motion, stored.record, conditions.lead_s, conditions.tolerance_deg)
    page: Path = arguments.out or arguments.folder / REPORT_FILE
    try:
        write_whole(page, run_report(stored, checked))
    except OSError as error:
        raise PlannerError(f"{page}: the page cannot be written there ({error.strerror or error})") from error
    sys.stdout.write(f"{page}\n")
    return 0
