"""Plan one strip as any scan is planned: its maps, a plan in the cheapest arm configuration, and the checks of both."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from planner.adaptive.strip import Strip
from planner.adaptive.surroundings import Surroundings
from planner.cell.obstacles import Obstacle
from planner.cell.scan_path import ScanPath
from planner.execution.clear_path import BlockedPathError, check_ends
from planner.execution.run_input import RunInput
from planner.execution.table_motion import TableMotion
from planner.kinematics.configuration import Configuration
from planner.map.config_map import ConfigurationMap
from planner.map.map_builder import build_maps
from planner.plans.arm_check import PlannedArm, arm_fault
from planner.plans.arm_motion import arm_motion
from planner.plans.arm_on_path import arm_along
from planner.plans.plan import NoPlan, Plan, Planner
from planner.plans.problem import Problem

# Where the arm cannot follow at the strip's own speed, it may be swept this much slower.
_SLOWER = (1.0, 2.0, 4.0)


@dataclass(frozen=True, eq=False)
class StripPlan:
    """A strip with its motion.

    Attributes:
        strip: As it will be swept, perhaps slower than asked.
        planned: The motion, as that of any scan.
    """

    strip: Strip
    planned: RunInput

    @property
    def plan(self) -> Plan:
        """The table's motion."""
        return self.planned.plan

    @property
    def motion(self) -> TableMotion:
        """What the table does, from the run-up to the stop."""
        return self.planned.motion()

    def turned(self, turns: int) -> "StripPlan":
        """Return the same, full turns of the table farther."""
        return replace(self, planned=self.planned.turned(turns))


def plan_strip(
    surroundings: Surroundings,
    strip: Strip,
    solid: Obstacle,
    planner: Planner,
    configurations: Sequence[Configuration],
    angle_count: int,
) -> StripPlan | str:
    """Return the cheapest plan of a strip, or in one clause why it has none.

    Args:
        surroundings: The cell.
        strip: What to sweep.
        solid: What counts as solid on the table.
        planner: Who plans.
        configurations: Arm configurations to compare.
        angle_count: Table angles of a map.
    """
    maps = build_maps(surroundings.map_problem(strip.T_WS, solid), list(configurations), angle_count)
    reason = "no arm configuration reaches all of it"
    for slower in _SLOWER:
        slow = replace(strip, path=ScanPath(strip.T_WS, slower * strip.path.step_s))
        outcomes = [
            _planned(surroundings, slow, each, map_, planner)
            for each, map_ in maps.items()
            if not map_.blocked_locations
        ]
        found = [each for each in outcomes if isinstance(each, StripPlan)]
        if found:
            return min(found, key=lambda each: each.plan.cost.total)
        reason = next((each for each in outcomes if isinstance(each, str)), reason)
    return reason


def _planned(
    surroundings: Surroundings, strip: Strip, configuration: Configuration, map_: ConfigurationMap, planner: Planner
) -> StripPlan | str:
    arm = arm_along(surroundings.cell, strip.T_WS, configuration)
    problem = Problem(map_, strip.path.step_s, surroundings.limits, surroundings.weights, arm=arm)
    plan = planner(problem)
    if isinstance(plan, NoPlan):
        return plan.reason
    if plan.pauses:
        return f"a pause is needed after pose {plan.pauses[0].step}"
    joints_deg = arm_motion(arm, plan).robot_deg
    fault = arm_fault(PlannedArm(surroundings.cell, strip.T_WS, joints_deg), plan)
    if fault is not None:
        return fault
    planned = RunInput(surroundings.name, plan, problem, joints_deg, surroundings.cell.arm)
    try:
        check_ends(map_, planned.motion())
    except BlockedPathError as error:
        return str(error)
    return StripPlan(strip, planned)
