"""Check the arm's part of a plan: whether the arm holds the probe at the required poses within its limits."""

from typing import NamedTuple

import numpy as np

from planner.arrays import FloatArray
from planner.cell.cell import Cell
from planner.kinematics.configuration import Configuration
from planner.kinematics.joint_configurations import configurations
from planner.kinematics.joint_limits import first_joint_fault
from planner.plans.plan import Plan

# Joints in a file have nine decimals, which is some nanometers at the probe; a joint error of 0.001 deg is detected.
_POSITION_TOLERANCE_MM = 1e-3
_AXIS_TOLERANCE = 1e-5


class PlannedArm(NamedTuple):
    """The arm's part of a plan.

    Attributes:
        cell: the arm and its placements.
        T_WS: (n + 1, 4, 4) the scan locations.
        joints_deg: (n + 1, 6) the robot's own joint angles at the scan locations, on the intended turns.
    """

    cell: Cell
    T_WS: FloatArray
    joints_deg: FloatArray


def arm_fault(planned: PlannedArm, plan: Plan) -> str | None:
    """Return why an arm cannot follow a plan, as a clause; None if it can."""
    cell, T_WS, joints_deg = planned
    fault = first_joint_fault(cell.arm, joints_deg, plan.step_s, [pause.step for pause in plan.pauses])
    if fault is not None:
        return str(fault)
    without = np.flatnonzero(~np.isfinite(T_WS).all(axis=(1, 2)))
    if len(without):
        return f"at location {int(without[0])} there is no pose of the probe"
    joints = cell.arm.joints(joints_deg)
    goals = cell.table_factors(plan.angles_deg) @ cell.location_factors(T_WS)
    off = np.abs(cell.arm.flange_poses(joints) - goals)
    far = np.flatnonzero(
        (off[:, :3, 3] > _POSITION_TOLERANCE_MM).any(axis=1) | (off[:, :3, :3] > _AXIS_TOLERANCE).any(axis=(1, 2))
    )
    if len(far):
        location = int(far[0])
        return f"at location {location} its joints put the probe {np.linalg.norm(off[location, :3, 3]):.3f} mm away"
    asked = [Configuration.parse(name) for name in plan.configurations]
    others = np.flatnonzero(configurations(cell.arm, joints) != np.array(asked))
    if len(others):
        location = int(others[0])
        return f"at location {location} the joints are not in {asked[location].label}, the configuration of the plan"
    return None
