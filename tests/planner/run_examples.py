"""A short scan to run: plan and map on disk, as written by the planner's commands."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from planner.arrays import FloatArray
from planner.cell.cell import Cell
from planner.execution.run_input import RunInput
from planner.geometry.transforms import rigid_inverse
from planner.kinematics.configuration import Configuration
from planner.map.config_map import ConfigurationMap
from planner.map.map_file import save_maps
from planner.map.synthetic_maps import blocks_map
from planner.planning.dynamic_programming import dynamic_programming
from planner.plans.plan import Pause, Plan, make_plan
from planner.plans.problem import Problem
from planner.table.motion import roll_out

CONFIGURATION = Configuration.parse("LEFTY-ABOVE-NOFLIP")
LOCATIONS = 16
CELL = Cell()
JOINTS_DEG = np.array([[4.0 * k, -60.0, 150.0, 0.0, 45.0, 0.0] for k in range(LOCATIONS)])


def scan_locations(angles_deg: FloatArray, joints_deg: FloatArray) -> FloatArray:
    """Return the poses of the probe on the workpiece that joints reach at table angles."""
    probe = CELL.arm.flange_poses(np.radians(joints_deg)) @ CELL.T_FS
    return rigid_inverse(CELL.table_factors(angles_deg) @ CELL.T_TW) @ probe


def short_problem() -> Problem:
    """Return a problem whose table has to move: a forbidden block approaches it."""
    blocks = [(0, LOCATIONS - 1, 200, 240), (6, LOCATIONS - 1, 340, 359), (6, LOCATIONS - 1, 0, 4)]
    plain = blocks_map(LOCATIONS, 360, blocks, edge=6)
    about = {"configuration": CONFIGURATION.label, "digest": "short", "scan": "short", "arm": asdict(CELL.arm)}
    reasons = (plain.values == 0.0).astype(np.uint8)
    return Problem(ConfigurationMap(plain.values, reasons, metadata=about), 0.1, start_angle_deg=0.0)


def short_run_input() -> RunInput:
    problem = short_problem()
    plan = dynamic_programming(problem)
    assert isinstance(plan, Plan)
    return RunInput("short", plan, problem, np.zeros((LOCATIONS, 6)), CELL.arm)


def paused_run_input() -> RunInput:
    """Return a scan with a pause in its middle, in which the table turns by 50 degrees."""
    problem = Problem(ConfigurationMap(np.ones((LOCATIONS, 360))), 0.1)
    accelerations = np.array([20.0] * 5 + [0.0] * (LOCATIONS - 6))
    angles, speeds = roll_out(10.0, 0.0, accelerations, 0.1)
    angles[10:], speeds[10:] = angles[9] + 50.3, 0.0
    accelerations[10:] = 0.0
    plan = make_plan(problem, "by hand", angles, speeds, accelerations, [Pause(9, float(angles[9]), float(angles[10]))])
    return RunInput("paused", plan, problem, np.zeros((LOCATIONS, 6)), CELL.arm)


def document_of(run_input: RunInput) -> dict[str, Any]:
    plan, problem = run_input.plan, run_input.problem
    return {
        "format": "seventh-axis plan",
        "format_version": 1,
        "planner": plan.planner,
        "configuration": CONFIGURATION.label,
        "step_s": plan.step_s,
        "table": {
            "angles_deg": plan.angles_deg.tolist(),
            "speeds_deg_s": plan.speeds_deg_s.tolist(),
            "accelerations_deg_s2": plan.accelerations_deg_s2.tolist(),
            "pauses": [pause._asdict() for pause in plan.pauses],
        },
        "joints_deg": JOINTS_DEG.tolist(),
        "arm": asdict(CELL.arm),
        "arm_fault": None,
        "locations": scan_locations(plan.angles_deg, JOINTS_DEG).tolist(),
        "cell": {"T_BT": CELL.T_BT.tolist(), "T_TW": CELL.T_TW.tolist(), "T_FS": CELL.T_FS.tolist()},
        "limits": problem.limits._asdict(),
        "weights": {"k_a": problem.terms.acceleration_weight, "k_w": problem.terms.speed_weight},
        "cost": plan.cost._asdict() | {"total": plan.cost.total},
        "provenance": {"scan": run_input.name, "map": {"digest": "short"}},
    }


def write_short_scan(folder: Path, **changes: object) -> Path:
    """Write plan and map of the short scan and return the plan's path; `changes` replace entries of the plan."""
    run_input = short_run_input()
    save_maps(folder / "map.npz", {CONFIGURATION: run_input.problem.map})
    plan_file = folder / "plan.json"
    plan_file.write_text(json.dumps(document_of(run_input) | changes), encoding="utf-8")
    return plan_file
