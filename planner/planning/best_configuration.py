"""Choose the arm configuration for a scan: the one whose map has the cheapest plan."""

from collections.abc import Mapping
from typing import NamedTuple

from planner.cell.scan import Scan
from planner.cell.unit_hints import unit_hint
from planner.plans.arm_motion import arm_follows
from planner.plans.plan import Infeasibility, NoPlan, Outcome, Plan, Planner
from planner.plans.problem import Problem
from protocol.program.progress import Progress


class Comparison(NamedTuple):
    """One outcome per arm configuration.

    Attributes:
        outcomes: result of the planner by configuration, in the given order.
        best: the configuration of the cheapest plan that the arm can follow, the first of equal ones. If it can follow
            none, that of the cheapest plan; None without a plan.
    """

    outcomes: Mapping[str, Outcome]
    best: str | None

    @property
    def farthest(self) -> tuple[str, NoPlan]:
        """If there is no plan, the configuration that gets farthest, and why no farther."""
        refused = {name: each for name, each in self.outcomes.items() if isinstance(each, NoPlan)}
        return max(refused.items(), key=lambda item: item[1].location or 0)

    @property
    def refusal(self) -> str:
        """The same as text."""
        name, no_plan = self.farthest
        return f"{name} gets farthest: {no_plan.reason}"

    def why_no_plan(self, scan: Scan) -> str:
        """Return in one sentence why a scan has no plan.

        If whole locations are blocked, a wrong unit may be the reason.
        """
        reason = f"{scan.name}: there is no plan; {self.refusal}"
        refused = [each for each in self.outcomes.values() if isinstance(each, NoPlan)]
        is_blocked = all(each.infeasibility is Infeasibility.BLOCKED_LOCATION for each in refused)
        hint = unit_hint(scan) if is_blocked else None
        return f"{reason}; {hint}" if hint else reason


def best_configuration(
    problems: Mapping[str, Problem], planner: Planner, progress: Progress | None = None
) -> Comparison:
    """Plan for each arm configuration and compare.

    Costs of different configurations can be compared only with equal weights, limits and start; the caller ensures
    this.

    Args:
        problems: one problem per configuration, each with its own map.
        planner: the planner for the comparison.
        progress: called with the number of finished configurations and of all configurations, before and after each.
    """
    outcomes: dict[str, Outcome] = {}
    for name, problem in problems.items():
        if progress is not None:
            progress(len(outcomes), len(problems))
        outcomes[name] = planner(problem)
    if progress is not None:
        progress(len(problems), len(problems))
    ranks = {
        name: (not arm_follows(problems[name], outcome), outcome.cost.total)
        for name, outcome in outcomes.items()
        if isinstance(outcome, Plan)
    }
    return Comparison(outcomes, min(ranks, key=lambda name: ranks[name]) if ranks else None)
