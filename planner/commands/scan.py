"""`python -m planner scan`: perform a scan with a simulated probe, and compute the error budget of its cloud."""

import argparse
import sys
from datetime import datetime
from pathlib import Path

from planner.cell.scan import load_scan, with_mesh
from planner.commands import options
from planner.defaults import REPORT_FILE
from planner.errors import PlannerError
from planner.scanning.latched_run import TriggerConditions
from planner.scanning.scan_file import save_scan, scan_document
from planner.scanning.scan_report import scan_report, verdict_of
from planner.scanning.scan_run import Scanned, ScanOptions, scan_workpiece
from planner.set_aside import set_aside
from protocol import TableError
from protocol.color import colored
from protocol.page import Origin
from protocol.progress import progress_line
from protocol.whole_file import write_whole

_INCOMPLETE = 1
SCAN_RESULTS = ("cloud.ply", "cloud.xyz", "scan.json", REPORT_FILE)


def run(arguments: argparse.Namespace) -> int:
    """Scan, write cloud, figures and report, print a summary, and return the exit status."""
    set_aside(arguments.out, SCAN_RESULTS, keep=() if arguments.mesh is None else (arguments.mesh,))
    progress = progress_line("mesh", sys.stderr)
    scan = load_scan(arguments.scan, options.say, progress)
    if arguments.mesh is not None:
        scan = with_mesh(scan, arguments.mesh, arguments.unit, options.say, progress)
    asked = ScanOptions(
        port=options.fresh_table(arguments.port, decimals=arguments.decimals, seed=arguments.seed),
        baud=arguments.baud,
        decimals=arguments.decimals,
        lag_s=arguments.lag,
        control=arguments.control,
        time_scale=arguments.time_scale,
        run_on_deg=arguments.run_on,
        configuration=arguments.configuration,
        angle_count=arguments.angles,
        exact_calibration=arguments.exact_calibration,
        xyz=arguments.xyz,
        triggers=TriggerConditions(rate_hz=arguments.rate, seed=arguments.seed),
        seed=arguments.seed,
    )
    out: Path = arguments.out
    in_simulated_time = arguments.port.startswith("emulator://")
    begun = None if in_simulated_time else datetime.now().astimezone().isoformat(timespec="seconds")
    try:
        scanned = scan_workpiece(scan, asked, out, lambda label: progress_line(label, sys.stderr))
        save_scan(out / "scan.json", scan_document(scanned))
        write_whole(out / REPORT_FILE, scan_report(scanned, Origin(arguments.command_line, begun)))
    except TableError as error:
        raise PlannerError(str(error)) from error
    except OSError as error:
        raise PlannerError(f"{out}: cannot write the scan ({error.strerror or error})") from error
    verdict = colored(verdict_of(scanned), "good" if scanned.is_whole else "bad", sys.stdout)
    sys.stdout.write(f"{scanned.scan.name}: {verdict}\n{summary(scanned)}")
    return 0 if scanned.is_whole else _INCOMPLETE


def summary(scanned: Scanned) -> str:
    """Return the figures of a scan, as text."""
    run, budget = scanned.run, scanned.budget
    mean, sigma, within, greatest = (f"{1e3 * value:.1f}" for value in budget.distances)
    shares = [
        (
            str(part),
            f"{1e3 * share.displacement_mm:.2f}",
            f"{1e3 * share.across_mm:.2f}",
            f"{1e3 * share.without_mm:.2f}",
        )
        for part, share in budget.parts.items()
    ]
    total = budget.total
    shares.append(("all together", f"{1e3 * total.displacement_mm:.2f}", f"{1e3 * total.across_mm:.2f}", ""))
    shares.append(("all switched off", f"{1e3 * budget.none_mm:.1g}", "", ""))
    lines = [
        f"profiles   {run.triggers} taken, {len(run.dropped)} dropped because a latch was missing",
        f"dead line  {scanned.dead_line}",
        f"distance   mean {mean}, sigma {sigma}, 95 % within {within}, maximum {greatest} µm",
        f"{'rms (µm)':24} {'displacement':>12} {'across':>8} {'without':>8}",
        *(f"  {name:22} {alone:>12} {across:>8} {without:>8}".rstrip() for name, alone, across, without in shares),
    ]
    return "\n".join(lines) + "\n"
