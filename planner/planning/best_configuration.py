"""Which arm configuration to scan in: the one whose map has the cheapest plan."""

from collections.abc import Callable, Mapping
from typing import NamedTuple

from planner.planning.plan import Outcome, Plan
from planner.planning.problem import Problem


class Comparison(NamedTuple):
    """One outcome per arm configuration.

    Attributes:
        outcomes: what the planner answered, by configuration, in the order asked.
        best: the configuration of the cheapest plan, the first of equal ones; None where no one has a plan.
    """

    outcomes: Mapping[str, Outcome]
    best: str | None


def best_configuration(problems: Mapping[str, Problem], planner: Callable[[Problem], Outcome]) -> Comparison:
    """Plan for each arm configuration and compare.

    Costs of different configurations compare only under equal weights, limits and start; that is up to the caller.

    Args:
        problems: one problem per configuration, each with its own map.
        planner: the planner to compare by.
    """
    outcomes = {name: planner(problem) for name, problem in problems.items()}
    costs = {name: outcome.cost.total for name, outcome in outcomes.items() if isinstance(outcome, Plan)}
    return Comparison(outcomes, min(costs, key=lambda name: costs[name]) if costs else None)
