"""The input of `run`: a plan file, checked against its map."""

import json
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from planner.arrays import FloatArray
from planner.errors import PlannerError
from planner.execution.table_motion import PauseTimes, TableMotion
from planner.kinematics.arm import Arm
from planner.kinematics.configuration import Configuration
from planner.map.map_file import MAP_FILE, load_maps
from planner.plans.arm_check import arm_fault
from planner.plans.plan import Plan, path_cost
from planner.plans.plan_check import contradiction
from planner.plans.plan_file import StoredPlan, load_plan
from planner.plans.problem import Problem
from planner.plans.verification import verify
from protocol.program.command_line import program_name


class RunInputError(PlannerError):
    """A plan that must not be executed: it is damaged, edited, or from another map."""


@dataclass(frozen=True, eq=False)
class RunInput:
    """A plan and its basis.

    Attributes:
        name: name of the scan.
        plan: the motion of the table.
        problem: map, limits and weights.
        joints_deg: (n + 1, 6) joints of the arm at each location.
        document: content of the plan file.
    """

    name: str
    plan: Plan
    problem: Problem
    joints_deg: FloatArray
    arm: Arm

    def motion(self, pause_times: PauseTimes | None = None) -> TableMotion:
        """Return the motion of the table, from the run-up to the stop."""
        return TableMotion(self.plan, self.problem.limits, pause_times or PauseTimes())

    def with_cost(self) -> "RunInput":
        """Return the same input with the computed cost of the motion, instead of the cost in the file."""
        plan = self.plan
        motion = plan.angles_deg, plan.speeds_deg_s, plan.accelerations_deg_s2
        return replace(self, plan=replace(plan, cost=path_cost(self.problem, *motion, plan.pauses)))

    def turned(self, turns: int) -> "RunInput":
        """Return the same scan, full turns of the table farther."""
        return replace(self, plan=self.plan.turned(turns))


def load_run_input(plan_file: Path, map_file: Path | None = None) -> RunInput:
    """Return a plan with its map, which is `map.npz` beside the plan unless another file is given.

    Raises:
        PlannerError: a file cannot be read, is damaged or edited, or plan and map do not belong together.
    """
    stored = load_plan(plan_file)
    map_file = map_file or plan_file.with_name(MAP_FILE)
    if not map_file.is_file():
        raise RunInputError(
            f"{map_file}: the map of the plan was not found;"
            f" to write it: {program_name('planner')} map {stored.scan} --out {map_file.parent}"
        )
    maps = load_maps(map_file)
    configuration = Configuration.parse(stored.plan.configuration)
    if configuration not in maps or maps[configuration].metadata.get("digest") != stored.map_digest:
        raise RunInputError(f"{map_file}: is not the map of {plan_file}; compute map and plan again")
    problem = Problem(maps[configuration], stored.plan.step_s, stored.limits, stored.weights)
    run_input = RunInput(stored.scan, stored.plan, problem, stored.arm.joints_deg, stored.arm.cell.arm)
    _check(plan_file, run_input)
    _check_arm(plan_file, run_input, stored)
    return run_input.with_cost()


def _check(plan_file: Path, run_input: RunInput) -> None:
    """Refuse a plan that violates its own equations, its limits, or a forbidden region."""
    plan, problem = run_input.plan, run_input.problem
    locations = problem.map.location_count
    if len(plan.angles_deg) != locations or run_input.joints_deg.shape != (locations, 6):
        raise RunInputError(f"{plan_file}: is damaged: the plan does not have the {locations} locations of its map")
    numbers = plan.angles_deg, plan.speeds_deg_s, plan.accelerations_deg_s2
    if not all(np.isfinite(array).all() for array in numbers):
        raise RunInputError(f"{plan_file}: is damaged: it contains values that are not numbers")
    fault = contradiction(plan)
    if fault is not None:
        raise RunInputError(f"{plan_file}: has been edited: {fault}")
    checked = verify(problem, plan)
    if not checked.within_limits:
        raise RunInputError(f"{plan_file}: exceeds its own limits; create the plan again")
    if checked.forbidden_steps:
        raise RunInputError(
            f"{plan_file}: meets a forbidden region in step {checked.forbidden_steps[0]}; create the plan again"
        )


def _check_arm(plan_file: Path, run_input: RunInput, stored: StoredPlan) -> None:
    """Refuse a plan that the arm cannot follow, by the file or by this check, or with an arm other than the map's."""
    if run_input.problem.map.metadata.get("arm") != json.loads(json.dumps(asdict(stored.arm.cell.arm))):
        raise RunInputError(f"{plan_file}: its arm is not the arm of its map; compute map and plan again")
    if len(stored.arm.T_WS) != run_input.problem.map.location_count:
        raise RunInputError(f"{plan_file}: is damaged: it contains {len(stored.arm.T_WS)} poses of the probe")
    fault = arm_fault(stored.arm, stored.plan) or stored.arm_fault
    if fault is not None:
        raise RunInputError(
            f"{plan_file}: the arm cannot follow the plan: {fault}; create a plan for a path with less rotation of the"
            " probe or more time"
        )
