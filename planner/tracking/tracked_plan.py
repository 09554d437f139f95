"""What was decided step by step, as a plan: judged, stored and shown like one that was made at once."""

from dataclasses import replace

import numpy as np

from planner.cell.scan import Scan
from planner.cell.scan_path import ScanPath
from planner.kinematics.joint_path import joint_speeds_deg_s
from planner.map.config_map import ConfigurationMap
from planner.plans.arm_motion import ArmMotion
from planner.plans.arm_on_path import arm_on_path
from planner.plans.plan import Plan, make_plan
from planner.plans.problem import Problem
from planner.tracking.track_record import TrackRecord
from planner.tracking.tracker import Tracker


def tracked_plan(scan: Scan, tracker: Tracker, observer: TrackRecord) -> tuple[Problem, Plan, ArmMotion, Scan]:
    """Return the plan that was carried out, with its problem, its arm, and the scan of the locations reached.

    Args:
        scan: cell, limits and weights.
        tracker: who decided.
        observer: what was decided, with at least two locations.
    """
    T_WS = np.stack(observer.T_WS[: observer.location_count])
    scan = replace(scan, predefined_path=ScanPath(T_WS, scan.path.step_s))
    values, reasons = observer.columns()
    configuration = observer.configuration
    metadata = dict(tracker.map_metadata(T_WS)) | {"configuration": configuration.label}
    map_ = ConfigurationMap(values, reasons, metadata=metadata)
    arm = arm_on_path(scan, configuration)
    angles, speeds, accelerations = observer.motion()
    problem = Problem(map_, scan.path.step_s, scan.limits, scan.weights, float(angles[0]), 0.0, arm)
    plan = make_plan(problem, tracker.settings.planner, angles, speeds, accelerations, observer.pauses)
    plan = replace(plan, waits=observer.waits)
    joints = observer.joints()
    joint_speeds = joint_speeds_deg_s(joints, scan.path.step_s)
    joint_speeds[[pause.step + 1 for pause in plan.pauses]] = 0.0
    central, _ = arm.solve(np.array([0]), angles[:1])
    turns = np.rint((joints[0] - central[0]) / (2.0 * np.pi)).astype(np.int64)
    return problem, plan, ArmMotion(arm.arm, joints, joint_speeds, turns), scan
