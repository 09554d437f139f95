"""`python -m planner track`: plan the table while it moves, as scan locations become known."""

import argparse
import sys

from planner.cell.scan import load_scan
from planner.commands import options
from planner.commands.run import run_options, status_of, summary
from planner.defaults import REPORT_FILE
from planner.errors import PlannerError
from planner.execution.run_report import write_report
from planner.set_aside import set_aside
from planner.tracking.track_file import decision_times_s
from planner.tracking.track_report import track_blocks
from planner.tracking.track_run import RESULTS, Finished, TrackOptions, track_scan
from protocol import TableError
from protocol.program.progress import progress_line


def run(arguments: argparse.Namespace) -> int:
    """Track the scan, write what happened, print the verdict, and return the exit status."""
    set_aside(arguments.out, RESULTS)
    scan = load_scan(arguments.scan, options.say, progress_line("mesh", sys.stderr))
    asked = TrackOptions(
        run=run_options(arguments),
        poses=arguments.poses,
        planner=arguments.planner,
        view=arguments.view,
        configuration=arguments.configuration,
        angle_count=arguments.angles,
        reconfigure=arguments.reconfigure,
        wait_s=arguments.wait,
    )
    try:
        finished = track_scan(scan, arguments.out, asked, options.say, lambda label: progress_line(label, sys.stderr))
        write_report(arguments.out, arguments.out / REPORT_FILE, arguments.command_line, track_blocks(arguments.out))
    except TableError as error:
        raise PlannerError(str(error)) from error
    except OSError as error:
        raise PlannerError(f"{arguments.out}: cannot write the run ({error.strerror or error})") from error
    sys.stdout.write(summary(finished.checked) + track_summary(finished))
    sys.stderr.write(f"{finished.duration}\n")
    if finished.checked.failure is not None:
        sys.stderr.write(f"the data recorded so far is in {arguments.out}\n")
    return status_of(finished.checked)


def track_summary(finished: Finished) -> str:
    """Return how the path was tracked, for people."""
    record, tracker, price = finished.record, finished.tracker, finished.price
    times = {name: 1000.0 * value for name, value in decision_times_s(record).items()}
    waited_s = sum(wait.duration_s for wait in record.waits)
    known = "no plan without a pause" if price.known is None else f"{price.known:.4f}"
    ratio = "" if price.ratio is None else f"; ratio {price.ratio:.4f}"
    lines = [
        f"tracked    {record.location_count} of {tracker.count} locations, {tracker.settings.planner},"
        f" {tracker.settings.view} columns in view, {tracker.configuration.label}",
        f"decisions  {len(record.decision_s)}, of which {tracker.missed} were not ready in time; median"
        f" {times['median']:.2f} ms, 99.9 % {times['share_999']:.2f} ms, worst {times['worst']:.2f} ms",
        f"stops      {len(record.pauses)} pauses, {tracker.reconfigurations} changes of configuration,"
        f" {waited_s:.1f} s of waiting",
        f"price      tracked {price.tracked:.4f}, with full knowledge {known}{ratio}",
    ]
    return "\n".join(lines) + "\n"
