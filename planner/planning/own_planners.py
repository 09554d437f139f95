"""Planners by name: those that are shipped, and those of other packages, whose answers are checked."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from planner.arrays import FloatArray
from planner.defaults import PLANNER_NAMES
from planner.planning.plan import NoPlan, Outcome, Plan, Planner, path_cost
from planner.planning.plan_check import plan_fault
from planner.planning.planners import PLANNERS
from planner.planning.problem import Problem
from planner.plug_ins import PLANNER_GROUP, PlugInError, failure, load_plug_in, plug_in_names


def planner_names() -> list[str]:
    """Return the names of all planners, the shipped ones first; a plug-in cannot take the name of a shipped one."""
    return [*PLANNER_NAMES, *(name for name in plug_in_names(PLANNER_GROUP) if name not in PLANNER_NAMES)]


def planner_named(name: str) -> Planner:
    """Return a planner.

    Raises:
        PlugInError: There is none of that name, or it cannot be loaded.
    """
    if name in PLANNERS:
        return PLANNERS[name]
    function = load_plug_in(PLANNER_GROUP, name, PLANNER_NAMES)
    if not callable(function):
        raise PlugInError(f"planner {name!r}: is {_kind(function)}; it must be a function from a Problem to a Plan")
    return checked(name, function)


def checked(name: str, function: Callable[[Problem], Any]) -> Planner:
    """Return a planner that somebody brings, with its name and cost set here, and refused where it breaks the rules.

    What it returns raises PlugInError unless it is a `NoPlan`, or a `Plan` that answers the problem.
    """

    def plan(problem: Problem) -> Outcome:
        try:
            outcome = function(problem)
        except Exception as error:
            raise failure(PLANNER_GROUP, name, "failed", error) from error
        if isinstance(outcome, NoPlan):
            return replace(outcome, planner=name)
        if not isinstance(outcome, Plan):
            raise PlugInError(f"planner {name!r}: returned {_kind(outcome)}; it must return a Plan or a NoPlan")
        fault = plan_fault(problem, outcome)
        if fault is not None:
            raise PlugInError(f"planner {name!r}: returned no valid plan: {fault}")
        return _restated(problem, name, outcome)

    return plan


def _restated(problem: Problem, name: str, plan: Plan) -> Plan:
    """Return the plan with what is not for the planner to say, in arrays that nobody else can change."""
    motion = _frozen(plan.angles_deg), _frozen(plan.speeds_deg_s), _frozen(plan.accelerations_deg_s2)
    return Plan(
        name,
        str(problem.map.metadata.get("configuration", "")),
        problem.step_s,
        *motion,
        cost=path_cost(problem, *motion, plan.pauses),
        pauses=tuple(plan.pauses),
    )


def _frozen(array: FloatArray) -> FloatArray:
    copy = np.array(array, dtype=np.float64)
    copy.setflags(write=False)
    return copy


def _kind(value: object) -> str:
    return "None" if value is None else f"a value of type {type(value).__name__}"
