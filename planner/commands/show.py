"""`python -m planner show`: one HTML page of a run."""

import argparse
import sys
from pathlib import Path

from planner.commands.command_line import REPORT_FILE
from planner.errors import PlannerError
from planner.execution.run_file import load_run
from planner.execution.run_report import run_report
from planner.execution.run_verification import verify_run
from protocol.whole_file import write_whole


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
