"""The arm's joints that belong to a table's plan, piece by piece between pauses."""

import numpy as np

from planner.cell.scan import Scan
from planner.kinematics.configuration import Configuration
from planner.kinematics.joint_path import JointPath, joint_path
from planner.planning.plan import Plan
from planner.reasons import Reason


def arm_motion(scan: Scan, configuration: Configuration, plan: Plan) -> JointPath:
    """Return the joints along a plan, or the first step at which the arm cannot follow it.

    In a pause the arm retracts and approaches again, so neither its turns nor its speeds continue across one.
    """
    cell = scan.cell
    goals = cell.table_factors(plan.angles_deg) @ cell.location_factors(scan.path.T_WS)
    starts = [0, *(pause.step + 1 for pause in plan.pauses)]
    ends = [*starts[1:], len(goals)]
    pieces = [joint_path(cell.arm, configuration, goals[a:b], plan.step_s) for a, b in zip(starts, ends, strict=True)]
    joints = np.concatenate([piece.joints for piece in pieces])
    for start, piece in zip(starts, pieces, strict=True):
        if piece.step is not None:
            return JointPath(joints, piece.reason, start + piece.step)
    return JointPath(joints, Reason.REACHED, None)
