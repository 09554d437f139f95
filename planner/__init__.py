"""The scan planner: from a scan to configuration maps, a plan, and a verified run on the table.

    scan = planner.load_scan("cylinder")
    planned = planner.plan(scan)
    finished = planner.run(planned, "emulator://", "build/run")

Each name is loaded at its first use, so that `import planner` is fast.
"""

import protocol.program.quiet_start  # noqa: F401 - before the slow imports

# isort: split
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from planner.api import build_maps, plan, run, tracker, with_factors
    from planner.cell.scan import Scan, load_scan
    from planner.errors import PlannerError
    from planner.execution.run import RunOptions
    from planner.kinematics.configuration import Configuration
    from planner.kinematics.value import RatedPoses, UserFactor
    from planner.map.config_map import ConfigurationMap
    from planner.planning.scan_planning import PlannedScan
    from planner.plans.plan import Infeasibility, NoPlan, Plan, make_plan
    from planner.plans.problem import Problem
    from planner.tracking.tracker import Tracker, TrackSettings

_HOME = {
    "Configuration": "planner.kinematics.configuration",
    "ConfigurationMap": "planner.map.config_map",
    "Infeasibility": "planner.plans.plan",
    "NoPlan": "planner.plans.plan",
    "Plan": "planner.plans.plan",
    "PlannedScan": "planner.planning.scan_planning",
    "PlannerError": "planner.errors",
    "Problem": "planner.plans.problem",
    "RatedPoses": "planner.kinematics.value",
    "RunOptions": "planner.execution.run",
    "Scan": "planner.cell.scan",
    "TrackSettings": "planner.tracking.tracker",
    "Tracker": "planner.tracking.tracker",
    "UserFactor": "planner.kinematics.value",
    "build_maps": "planner.api",
    "load_scan": "planner.cell.scan",
    "make_plan": "planner.plans.plan",
    "plan": "planner.api",
    "run": "planner.api",
    "tracker": "planner.api",
    "with_factors": "planner.api",
}
"""The module of each public name."""

__all__ = [
    "Configuration",
    "ConfigurationMap",
    "Infeasibility",
    "NoPlan",
    "Plan",
    "PlannedScan",
    "PlannerError",
    "Problem",
    "RatedPoses",
    "RunOptions",
    "Scan",
    "TrackSettings",
    "Tracker",
    "UserFactor",
    "build_maps",
    "load_scan",
    "make_plan",
    "plan",
    "run",
    "tracker",
    "with_factors",
]


def __getattr__(name: str) -> Any:  # noqa: ANN401  # any public name
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = getattr(import_module(_HOME[name]), name)
    return globals()[name]


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
