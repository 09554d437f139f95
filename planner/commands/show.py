"""`python -m planner show`: one HTML page of a run."""

import argparse
import sys
from pathlib import Path

from planner.defaults import REPORT_FILE
from planner.errors import PlannerError
from planner.execution.run_report import write_report
from planner.tracking.track_report import track_blocks


def run(arguments: argparse.Namespace) -> int:
    """Write the page, print its name, and return the exit status."""
    page: Path = arguments.out or arguments.folder / REPORT_FILE
    try:
        write_report(arguments.folder, page, arguments.command_line, track_blocks(arguments.folder))
    except OSError as error:
        raise PlannerError(f"{page}: cannot write the page ({error.strerror or error})") from error
    sys.stdout.write(f"{page}\n")
    return 0
