"""`python -m planner show`: one HTML page of a run."""

import argparse
import sys
from pathlib import Path

from planner.commands.command_line import REPORT_FILE
from planner.errors import PlannerError
from planner.execution.run_file import load_run
from planner.execution.run_report import run_report
from planner.execution.run_verification import verify_run
from protocol.page import Origin
from protocol.whole_file import write_whole


def run(arguments: argparse.Namespace) -> int:
    """Write the page, print its name, and return the exit status."""
    page: Path = arguments.out or arguments.folder / REPORT_FILE
    write_report(arguments.folder, page, arguments.command_line)
    sys.stdout.write(f"{page}\n")
    return 0


def write_report(folder: Path, page: Path, command: str) -> None:
    """Write the page of the run in a folder; `command` is the command line for the page.

    Raises:
        PlannerError: the folder contains no run, or the page cannot be written.
    """
    stored = load_run(folder)
    conditions = stored.conditions
    checked = verify_run(stored.run_input, stored.motion, stored.record, conditions.lead_s, conditions.tolerance_deg)
    try:
        write_whole(page, run_report(stored, checked, Origin(command)))
    except OSError as error:
        raise PlannerError(f"{page}: cannot write the page ({error.strerror or error})") from error
