"""The planning problem of a scan: its map in one arm configuration, its limits and its arm."""

from planner.cell.scan import Scan
from planner.kinematics.configuration import Configuration
from planner.map.config_map import ConfigurationMap
from planner.plans.arm_on_path import arm_on_path
from planner.plans.problem import Problem


def scan_problem(scan: Scan, configuration_map: ConfigurationMap, start_angle_deg: float | None = None) -> Problem:
    """Return the planning problem of a scan in the configuration of a map, from rest."""
    configuration = Configuration.parse(str(configuration_map.metadata["configuration"]))
    arm = arm_on_path(scan, configuration)
    return Problem(configuration_map, scan.path.step_s, scan.limits, scan.weights, start_angle_deg, arm=arm)
