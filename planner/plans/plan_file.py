"""A plan on disk: one JSON file with everything needed to execute it. The same plan gives the same bytes."""

import json
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from planner.arrays import FloatArray
from planner.cell.cell import Cell
from planner.cell.scan import Scan
from planner.errors import ArmTableError, PlannerError, PoseError
from planner.kinematics.arm import Arm
from planner.plans.arm_check import PlannedArm
from planner.plans.arm_motion import ArmMotion
from planner.plans.plan import Pause, Plan, Wait
from planner.plans.problem import Problem
from planner.plans.verification import verify
from planner.table.cost import PathCost, Weights
from planner.table.motion import Limits
from protocol.files.data_file import DataFileError, read_json
from protocol.files.whole_file import write_whole
from protocol.program.command_line import program_name
from protocol.program.software_version import software_version

PLAN_FILE = "plan.json"
_FORMAT = "seventh-axis plan"
_FORMAT_VERSION = 1
_DECIMALS = 9


class PlanFileError(PlannerError):
    """A file that cannot be read, contains no plan, or is damaged."""


class StoredPlan(NamedTuple):
    """A plan as a file holds it.

    Attributes:
        scan: what the scan is called.
        plan: the motion of the table.
        limits: the limits of the table that it was made for.
        weights: the weights of its cost.
        arm: the arm's side of it.
        arm_fault: why the arm cannot follow, as the planner found it.
        map_digest: which map it was made on.
    """

    scan: str
    plan: Plan
    limits: Limits
    weights: Weights
    arm: PlannedArm
    arm_fault: object
    map_digest: object


def plan_document(scan: Scan, problem: Problem, plan: Plan, motion: ArmMotion) -> dict[str, Any]:
    """Return a plan with its scan, its limits and its provenance, as JSON values.

    Angles are in degrees, lengths in mm, times in s; `locations` contains the probe's poses in the workpiece frame, row
    by row. `start_turns` and the margins of the joints have one number per joint (see `ArmMotion`). `arm_fault` states
    why the arm cannot follow; such a plan is only for inspection.
    """
    checked = verify(problem, plan)
    cell = scan.cell
    return {
        "format": _FORMAT,
        "format_version": _FORMAT_VERSION,
        "planner": plan.planner,
        "configuration": plan.configuration,
        "step_s": plan.step_s,
        "table": {
            "angles_deg": plan.angles_deg.tolist(),
            "speeds_deg_s": plan.speeds_deg_s.tolist(),
            "accelerations_deg_s2": plan.accelerations_deg_s2.tolist(),
            "pauses": [
                {key: value for key, value in pause._asdict().items() if value is not None} for pause in plan.pauses
            ],
            **({"waits": [wait._asdict() for wait in plan.waits]} if plan.waits else {}),
        },
        "joints_deg": _rounded(motion.robot_deg),
        "start_turns": motion.start_turns.tolist(),
        "arm": asdict(cell.arm),
        "arm_fault": None if motion.step is None else f"{motion.reason.label} at location {motion.step}",
        "locations": _rounded(scan.path.T_WS),
        "cell": {"T_BT": _rounded(cell.T_BT), "T_TW": _rounded(cell.T_TW), "T_FS": _rounded(cell.T_FS)},
        "limits": problem.limits._asdict(),
        "weights": {"k_a": problem.terms.acceleration_weight, "k_w": problem.terms.speed_weight},
        "cost": plan.cost._asdict() | {"total": plan.cost.total},
        "margins": {
            "clearance_deg": checked.clearance_deg if np.isfinite(checked.clearance_deg) else None,
            "speed_deg_s": checked.speed_margin_deg_s,
            "acceleration_deg_s2": checked.acceleration_margin_deg_s2,
            "joint_limits_deg": _rounded(motion.limit_margins_deg),
            "joint_speeds_deg_s": _rounded(motion.speed_margins_deg_s),
        },
        "provenance": {
            "scan": scan.name,
            "software_version": software_version(),
            "map": _plain({k: v for k, v in problem.map.metadata.items() if k not in {"arm", "reasons"}}),
            "map_angles": problem.map.angle_count,
            "map_epsilon": problem.map.epsilon,
        },
    }


def save_plan(file: Path, document: dict[str, Any]) -> None:
    """Write a plan to `file`, which appears when it is complete."""
    write_whole(file, json.dumps(document, indent=1, allow_nan=False) + "\n")


def load_plan(file: Path) -> StoredPlan:
    """Return the table's motion from a file.

    Raises:
        PlanFileError: the file cannot be read, or is not a plan of this format.
    """
    try:
        document = read_json(file)
    except DataFileError as error:
        raise PlanFileError(str(error)) from error
    if not isinstance(document, dict) or document.get("format") != _FORMAT:
        raise PlanFileError(f"{file}: contains no plan of this program")
    if document.get("format_version") != _FORMAT_VERSION:
        raise PlanFileError(f"{file}: is not a plan of format version {_FORMAT_VERSION}")
    try:
        stored = _stored(file, document)
    except (ValueError, KeyError, TypeError, AttributeError, OverflowError) as error:
        raise PlanFileError(f"{file}: is damaged: {type(error).__name__}, {error}") from error
    except (ArmTableError, PoseError) as error:
        raise PlanFileError(f"{file}: is damaged: {error}") from error
    plan = stored.plan
    if not len(plan.angles_deg) == len(plan.speeds_deg_s) == len(plan.accelerations_deg_s2) + 1:
        raise PlanFileError(f"{file}: is damaged: angles, speeds and accelerations are inconsistent")
    return stored


def _stored(file: Path, document: dict[str, Any]) -> StoredPlan:
    scan = str(document["provenance"]["scan"])
    if "arm" not in document:
        raise PlanFileError(
            f"{file}: does not contain the arm, so its limits cannot be checked (an earlier version wrote it);"
            f" create the plan again: {program_name('planner')} plan {scan} --out {file.parent}"
        )
    table, cost = document["table"], document["cost"]
    return StoredPlan(
        scan=scan,
        plan=Plan(
            planner=str(document["planner"]),
            configuration=str(document["configuration"]),
            step_s=float(document["step_s"]),
            angles_deg=np.array(table["angles_deg"], dtype=np.float64),
            speeds_deg_s=np.array(table["speeds_deg_s"], dtype=np.float64),
            accelerations_deg_s2=np.array(table["accelerations_deg_s2"], dtype=np.float64),
            cost=PathCost(**{name: cost[name] for name in PathCost._fields}),
            pauses=tuple(Pause(**pause) for pause in table["pauses"]),
            waits=tuple(Wait(**wait) for wait in table.get("waits", ())),
        ),
        limits=Limits(*(float(document["limits"][name]) for name in Limits._fields)),
        weights=Weights(float(document["weights"]["k_a"]), float(document["weights"]["k_w"])),
        arm=_planned_arm(document),
        arm_fault=document.get("arm_fault"),
        map_digest=document["provenance"]["map"].get("digest"),
    )


def _planned_arm(document: dict[str, Any]) -> PlannedArm:
    """Return what a plan's document holds of the arm; numbers that are missing become NaN."""
    stored = document["arm"]
    columns = (tuple(map(float, stored[column.name])) for column in fields(Arm)[1:])
    T_BT, T_TW, T_FS = (
        np.array(document["cell"][name], dtype=np.float64).reshape(4, 4) for name in ("T_BT", "T_TW", "T_FS")
    )
    T_WS = np.array(document["locations"], dtype=np.float64).reshape(-1, 4, 4)
    joints_deg = np.array(document["joints_deg"], dtype=np.float64)
    return PlannedArm(Cell(Arm(str(stored["name"]), *columns), T_BT, T_TW, T_FS), T_WS, joints_deg)


def _rounded(array: FloatArray) -> list[Any]:
    """Return nested lists rounded below a nanometer, with None for missing numbers."""
    rounded = (np.round(array, _DECIMALS) + 0.0).astype(object)
    rounded[np.isnan(array)] = None
    return list(rounded.tolist())


def _plain(value: object) -> object:
    """Return the value as a JSON value."""
    return json.loads(json.dumps(value, default=str))
