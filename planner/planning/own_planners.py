"""Planners by name: the shipped ones, and those of other packages, whose results are checked."""

from collections.abc import Callable
from typing import Any

import numpy as np

from planner.arrays import FloatArray
from planner.defaults import PLANNER_NAMES
from planner.planning.planners import PLANNERS
from planner.plans.plan import Infeasibility, NoPlan, Outcome, Pause, Plan, Planner, path_cost
from planner.plans.plan_check import plan_fault
from planner.plans.problem import Problem
from planner.plug_ins import PLANNER_GROUP, PlugInError, failure, load_plug_in, plug_in_names
from planner.reasons import Reason


def planner_names() -> list[str]:
    """Return the names of all planners, the shipped ones first; a plug-in cannot take the name of a shipped one."""
    return [*PLANNER_NAMES, *(name for name in plug_in_names(PLANNER_GROUP) if name not in PLANNER_NAMES)]


def planner_named(name: str) -> Planner:
    """Return a planner.

    Raises:
        PlugInError: there is no planner with that name, or it cannot be loaded.
    """
    if name in PLANNERS:
        return PLANNERS[name]
    function = load_plug_in(PLANNER_GROUP, name, PLANNER_NAMES)
    if not callable(function):
        raise PlugInError(f"planner {name!r}: is {_kind(function)}; it must be a function from a Problem to a Plan")
    return checked(name, function)


def checked(name: str, function: Callable[[Problem], Any]) -> Planner:
    """Return a user's planner. Its name and cost are set here, and invalid results are refused.

    A result raises PlugInError unless it is a `NoPlan`, or a `Plan` for the problem.
    """

    def plan(problem: Problem) -> Outcome:
        try:
            outcome = function(problem)
        except (Exception, SystemExit) as error:
            raise failure(PLANNER_GROUP, name, "failed", error) from error
        if not isinstance(outcome, NoPlan | Plan):
            raise PlugInError(f"planner {name!r}: returned {_kind(outcome)}; it must return a Plan or a NoPlan")
        try:
            if isinstance(outcome, NoPlan):
                return _restated_refusal(name, outcome)
            return _restated_plan(problem, name, outcome)
        except PlugInError:
            raise
        except Exception as error:  # a field of the wrong type
            raise failure(PLANNER_GROUP, name, f"returned no valid {type(outcome).__name__}", error) from error

    return plan


def _restated_refusal(name: str, no_plan: NoPlan) -> NoPlan:
    """Return the refusal with values of the right types."""
    location = None if no_plan.location is None else int(no_plan.location)
    joint = None if no_plan.joint is None else Reason(no_plan.joint)
    return NoPlan(name, Infeasibility(no_plan.infeasibility), location, joint)


def _restated_plan(problem: Problem, name: str, plan: Plan) -> Plan:
    """Return the plan with the fields that a planner does not set, and with read-only arrays."""
    fault = plan_fault(problem, plan)
    if fault is not None:
        raise PlugInError(f"planner {name!r}: returned no valid Plan: {fault}")
    motion = _frozen(plan.angles_deg), _frozen(plan.speeds_deg_s), _frozen(plan.accelerations_deg_s2)
    pauses = tuple(
        Pause(int(pause.step), float(pause.from_angle_deg), float(pause.to_angle_deg)) for pause in plan.pauses
    )
    configuration = str(problem.map.metadata.get("configuration", ""))
    cost = path_cost(problem, *motion, pauses)
    return Plan(name, configuration, problem.step_s, *motion, cost=cost, pauses=pauses)


def _frozen(array: FloatArray) -> FloatArray:
    copy = np.array(array, dtype=np.float64)
    copy.setflags(write=False)
    return copy


def _kind(value: object) -> str:
    return "None" if value is None else f"a value of type {type(value).__name__}"
