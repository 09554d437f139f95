"""`python -m planner scan`: perform a scan with a simulated probe, and compute the error budget of its cloud."""

import argparse
import sys
from datetime import datetime
from pathlib import Path
from typing import Any

from planner.adaptive.adaptive_report import adaptive_document, adaptive_report, adaptive_summary, adaptive_verdict
from planner.adaptive.adaptive_scan import AdaptOptions, scan_adaptively
from planner.adaptive.turn_over import (
    JOINED_FILE,
    TURNED_FOLDER,
    TurnedOver,
    scan_turned_over,
    turned_over_document,
    turned_over_summary,
)
from planner.cell.scan import Scan, load_scan, with_mesh
from planner.cell.workpiece import Cylinder
from planner.commands import options
from planner.defaults import REPORT_FILE, SHARE_SEEN
from planner.errors import PlannerError
from planner.scanning.latched_run import TriggerConditions
from planner.scanning.scan_file import save_scan, scan_document
from planner.scanning.scan_report import scan_report, verdict_of
from planner.scanning.scan_run import Scanned, ScanOptions, scan_workpiece
from planner.set_aside import set_aside
from protocol import TableError
from protocol.files.whole_file import write_whole
from protocol.program.color import colored
from protocol.program.extras import need
from protocol.program.page import Origin
from protocol.program.progress import Progress, progress_line, show_line

_INCOMPLETE = 1
SCAN_RESULTS = ("cloud.ply", "cloud.xyz", "normals.ply", "poses.csv", JOINED_FILE, "scan.json", REPORT_FILE)


def run(arguments: argparse.Namespace) -> int:
    """Scan, write cloud, figures and report, print a summary, and return the exit status."""
    if arguments.surface is not None:
        need("gpytoolbox")
        _check_surface_file(arguments.surface)
    if arguments.turn_over:
        need("small_gicp")
        if arguments.blind is not None:
            raise PlannerError("--turn-over: the other face is chosen by the mesh; leave out --blind")
    set_aside(arguments.out / TURNED_FOLDER, SCAN_RESULTS)
    set_aside(arguments.out, SCAN_RESULTS, keep=() if arguments.mesh is None else (arguments.mesh,))
    progress = progress_line("mesh", sys.stderr)
    scan = known = load_scan(arguments.scan, options.say, progress)
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
        normals=arguments.normals,
        surface=arguments.surface,
        triggers=TriggerConditions(rate_hz=arguments.rate, seed=arguments.seed),
        seed=arguments.seed,
    )
    out: Path = arguments.out
    in_simulated_time = arguments.port.startswith("emulator://")
    begun = None if in_simulated_time else datetime.now().astimezone().isoformat(timespec="seconds")
    try:
        if _is_adaptive(arguments) or not scan.has_path:
            return _adaptive(scan, known, asked, arguments, Origin(arguments.command_line, begun))
        scanned = scan_workpiece(scan, asked, out, _progress_of)
        save_scan(out / "scan.json", scan_document(scanned))
        write_whole(out / REPORT_FILE, scan_report(scanned, Origin(arguments.command_line, begun)))
    except TableError as error:
        raise PlannerError(str(error)) from error
    except OSError as error:
        raise PlannerError(f"{out}: cannot write the scan ({error.strerror or error})") from error
    verdict = colored(verdict_of(scanned), "good" if scanned.is_whole else "bad", sys.stdout)
    sys.stdout.write(f"{scanned.scan.name}: {verdict}\n{summary(scanned)}")
    return 0 if scanned.is_whole else _INCOMPLETE


def _adaptive(scan: Scan, known: Scan, asked: ScanOptions, arguments: argparse.Namespace, origin: Origin) -> int:
    """Scan adaptively; `known` has the mesh that the strips are chosen by. Return the exit status."""
    out: Path = arguments.out
    wanted = AdaptOptions(
        share=_share_wanted(arguments),
        most_strips=arguments.most_strips,
        bounds=None if arguments.blind is None else Cylinder(*arguments.blind),
    )
    found = scan_adaptively(scan, asked, wanted, out, _progress_of, _show_strips, known)
    show_line("", sys.stderr)
    document = scan_document(found.scanned) | {"adaptive": adaptive_document(found)}
    save_scan(out / "scan.json", document)
    write_whole(out / REPORT_FILE, adaptive_report(found, origin))
    sys.stdout.write(summary(found.scanned) + adaptive_summary(found))
    is_turned = True
    if arguments.turn_over and found.session.failure is None:
        turned = scan_turned_over(found, scan, known, asked, wanted, out, _progress_of, _show_strips)
        is_turned = _write_turned_over(turned, document, out, origin)
    if found.session.contradicts:
        raise PlannerError(f"{found.session.failure}; what was scanned is in {out}")
    return 0 if found.has_succeeded and is_turned else _INCOMPLETE


def _write_turned_over(turned: TurnedOver, document: dict[str, Any], out: Path, origin: Origin) -> bool:
    """Write and print what the second placement came to, and return whether it succeeded."""
    show_line("", sys.stderr)
    second = out / TURNED_FOLDER
    adaptive = adaptive_document(turned.second)
    save_scan(second / "scan.json", scan_document(turned.second.scanned) | {"adaptive": adaptive})
    write_whole(second / REPORT_FILE, adaptive_report(turned.second, origin))
    save_scan(out / "scan.json", document | {"turned_over": turned_over_document(turned)})
    sys.stdout.write(turned_over_summary(turned))
    if not turned.second.has_succeeded:
        sys.stdout.write(f"           turned over: {adaptive_verdict(turned.second)}\n")
    return turned.second.has_succeeded and not isinstance(turned.joined, str)


def _progress_of(label: str) -> Progress | None:
    return progress_line(label, sys.stderr)


def _show_strips(number: int, state: str) -> None:
    show_line(f"strip {number}: {state}", sys.stderr)


def _share_wanted(arguments: argparse.Namespace) -> float:
    """Return the share of what can be seen that is wanted; without the mesh it is not known while scanning."""
    if arguments.adapt is not None:
        return float(arguments.adapt)
    return 0.0 if arguments.blind is not None else SHARE_SEEN


def _is_adaptive(arguments: argparse.Namespace) -> bool:
    return arguments.adapt is not None or arguments.blind is not None or arguments.turn_over


def _check_surface_file(file: Path) -> None:
    """Refuse, before the scan, a file that could not be written after it."""
    if file.suffix.lower() != ".ply":
        raise PlannerError(f"{file}: a surface is written as PLY; choose a name that ends in .ply")
    if not file.parent.is_dir():
        raise PlannerError(f"{file}: there is no folder {file.parent}; create it, or choose another file")


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
