"""The price of an unknown future: the additional cost of a tracked path compared with a plan for the whole path."""

from dataclasses import replace
from typing import NamedTuple

from planner.planning.dynamic_programming import dynamic_programming
from planner.plans.plan import Plan
from planner.plans.problem import Problem


class Price(NamedTuple):
    """Costs of Eq. (7), in the configuration that was chosen; None where there is no plan without a pause.

    Attributes:
        tracked: of the path as it was tracked.
        known_from_start: cost of the best plan from the same start, for the whole path.
        known: of the best plan with a free start.
    """

    tracked: float
    known_from_start: float | None
    known: float | None

    @property
    def ratio(self) -> float | None:
        """The tracked cost against that of the best plan with a free start."""
        return None if self.known is None else self.tracked / self.known


def price_of_not_knowing(problem: Problem, plan: Plan) -> Price:
    """Return the price of a tracked path over its whole map."""
    if any(pause.configuration is not None for pause in plan.pauses):
        return Price(plan.cost.total, None, None)  # a plan has one configuration

    def cost(asked: Problem) -> float | None:
        outcome = dynamic_programming(asked)
        return outcome.cost.total if isinstance(outcome, Plan) else None

    same_start = replace(problem, start_angle_deg=float(plan.angles_deg[0]), start_speed_deg_s=0.0)
    return Price(plan.cost.total, cost(same_start), cost(replace(problem, start_angle_deg=None, start_speed_deg_s=0.0)))
