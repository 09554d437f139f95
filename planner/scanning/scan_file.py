"""The results of a scan as `scan.json`: angles in deg, lengths in mm, times in s."""

import json
from collections import Counter
from pathlib import Path
from typing import Any

from planner.scanning.scan_run import Knowledge, Scanned
from protocol.files.whole_file import write_whole

_FORMAT = "seventh-axis scan"
_FORMAT_VERSION = 1


def scan_document(scanned: Scanned) -> dict[str, Any]:
    """Return a scan as JSON values: its settings, the latched values, and the error budget."""
    options, run, budget = scanned.options, scanned.run, scanned.budget
    return {
        "format": _FORMAT,
        "format_version": _FORMAT_VERSION,
        "scan": scanned.scan.name,
        "mesh": None if scanned.scan.mesh_file is None else scanned.scan.mesh_file.name,
        "conditions": {
            "port": options.port,
            "baud": options.baud,
            "decimals": options.decimals,
            "run_on_deg": options.run_on_deg,
            "rate_hz": options.triggers.rate_hz,
            "seed": options.seed,
        },
        "dead_line": scanned.dead_line._asdict(),
        "configuration": scanned.planned.plan.configuration,
        "failure": run.failure or ("interrupted" if scanned.is_interrupted else None),
        "points": scanned.points,
        "distance_mm": budget.distances._asdict(),
        "error_mm": {
            "parts": {str(part): share._asdict() for part, share in budget.parts.items()},
            "together": budget.total._asdict(),
            "root_of_squares": budget.sum_mm,
            "all_off": budget.none_mm,
            "rounding_in_closed_form": budget.rounding_mm,
            "radius_mm": budget.radius_mm,
            "samples": budget.samples,
        },
        "coverage": {code.name.lower(): share for code, share in scanned.coverage.shares().items()},
        "calibration": _calibration(scanned.knowledge),
        "profiles": {
            "taken": run.triggers,
            "dropped": dict(Counter(drop.name.lower() for drop in run.dropped.values())),
            "number": run.numbers.tolist(),
            "time_s": run.times_s.round(6).tolist(),
            "table_deg": run.angles_deg.round(6).tolist(),
            "joints_deg": run.joints_deg.round(6).tolist(),
        },
    }


def save_scan(file: Path, document: dict[str, Any]) -> None:
    """Write a scan to `file`, which appears when it is complete."""
    write_whole(file, json.dumps(document, allow_nan=False) + "\n")


def _calibration(knowledge: Knowledge) -> dict[str, Any]:
    known, axis, probe = knowledge.calibration, knowledge.axis, knowledge.probe
    placements = {"T_FS": known.T_FS.tolist(), "T_BT": known.T_BT.tolist(), "T_TW": known.T_TW.tolist()}
    if axis is None or probe is None:
        return placements | {"exact": True}
    return placements | {
        "exact": False,
        "table_axis": {
            "rms_mm": axis.rms_mm,
            "uncertainty_mm": axis.uncertainty_mm,
            "uncertainty_deg": axis.uncertainty_deg,
            "point_error_mm": axis.point_error_mm,
        },
        "probe": {
            "rms_mm": probe.rms_mm,
            "noise_ratio": probe.noise_ratio,
            "fitted_radius_mm": probe.fitted_radius_mm,
            "radius_uncertainty_mm": probe.radius_uncertainty_mm,
            "point_error_mm": probe.point_error_mm,
            "uncertainty_mm": probe.uncertainty_mm,
            "uncertainty_deg": probe.uncertainty_deg,
            "starts": probe.starts,
            "wrong_starts": probe.wrong_starts,
        },
    }
