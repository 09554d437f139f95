"""Adaptive scans of many parts on an emulated table: strips beside the fewest that are possible, time and memory.

Other parts than the shipped ones can be named, such as the Stanford bunny in a scan file of `planner new-scan`.
"""

import resource
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple, TextIO

import emulator  # noqa: F401 - teaches pyserial the port emulator://
from planner.adaptive.adaptive_scan import AdaptiveScanned, AdaptOptions, scan_adaptively
from planner.adaptive.choice import choose
from planner.adaptive.known_part import KnownPart
from planner.adaptive.surroundings import Surroundings
from planner.cell.obstacles import workpiece_obstacle
from planner.cell.scan import Scan, load_scan
from planner.defaults import shipped_scans
from planner.scanning.probe import LaserProbe
from planner.scanning.scan_run import ScanOptions
from tools.bench.set_cover import fewest_strips
from tools.bench.timing import print_row

_SHARE = 0.99
_HEAD = (
    "part",
    "of whole",
    "of visible",
    "strips",
    "alone",
    "fewest",
    "verified",
    "session s",
    "choice s",
    "all s",
    "MB",
)
_WIDTHS = (22, 8, 10, 6, 5, 9, 9, 9, 8, 6, 5)


class _Choice(NamedTuple):
    """Strips chosen at once, before any is scanned, beside what a solver finds; CPU time of all of it."""

    strips: int
    fewest: str
    cpu_s: float


def bench(stream: TextIO, scans: tuple[str, ...] = ()) -> None:
    """Print a line for each part; times are CPU seconds of this process."""
    print(
        f"\nadaptive scans, {_SHARE:.0%} of what can be seen; times in CPU seconds but that of the session", file=stream
    )
    print_row(stream, _HEAD, _WIDTHS)
    for name in scans or shipped_scans():
        scan = load_scan(name)
        kinds = [("after its path", scan)] if scan.has_path else []
        kinds.append(("", replace(scan, predefined_path=None)))
        for kind, each in kinds:
            _bench_part(stream, f"{Path(name).stem} {kind}".strip(), each)


def _bench_part(stream: TextIO, name: str, scan: Scan) -> None:
    choice = _choice(scan) if not scan.has_path else None
    start_s = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        found = scan_adaptively(scan, ScanOptions(), AdaptOptions(_SHARE), Path(folder), lambda _: None)
    cpu_s = time.process_time() - start_s
    peak_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print_row(
        stream,
        (
            name, f"{found.share_of_whole:.1%}", f"{found.share_of_visible:.1%}", str(len(found.strips)),
            "" if choice is None else str(choice.strips), "" if choice is None else choice.fewest, _verified(found),
            f"{found.duration_s:.0f}", "" if choice is None else f"{choice.cpu_s:.1f}", f"{cpu_s:.1f}",
            f"{peak_mb:.0f}",
        ),
        _WIDTHS,
    )  # fmt: skip


def _choice(scan: Scan) -> _Choice:
    surroundings, probe = Surroundings.of(scan), LaserProbe.of(scan.cell.probe)
    solid = workpiece_obstacle(scan)
    start_s = time.process_time()
    policy = KnownPart(surroundings, scan.mesh, solid, probe, _SHARE, 1000, 20.0)
    strips = policy.next_strips()
    cpu_s = time.process_time() - start_s
    chosen = choose(policy.sees, policy.seen, policy.wanted, 1000)
    best = fewest_strips(policy.sees, policy.wanted, chosen)
    fewest = str(best.strips) if best.strips == best.at_least else f"{best.at_least} to {best.strips}"
    return _Choice(len(strips), fewest, cpu_s)


def _verified(found: AdaptiveScanned) -> str:
    good = sum(strip.verification.is_verified for strip in found.strips)
    return f"{good} of {len(found.strips)}"
