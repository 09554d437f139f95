"""Check any plan for its execution: forbidden regions, limits, and the margins from both."""

from typing import NamedTuple

import numpy as np

from planner.map.config_map import column_value
from planner.plans.crossing import halt_is_allowed, step_is_allowed
from planner.plans.plan import Plan
from planner.plans.problem import Problem, Terms

# Speeds and accelerations result from sums: an excess of this size over a limit is rounding.
ROUNDING = 1e-9


class Verification(NamedTuple):
    """The result of the check of a plan.

    Attributes:
        forbidden_steps: steps that touch a forbidden region at their end or before it, or in a wait before them; a
            wait at the last location counts to the last step.
        clearance_deg: minimum distance from a forbidden sample, along the angle axis, over all locations; infinity if
            no location has any.
        speed_margin_deg_s: margin to the speed limit; negative if it is exceeded.
        acceleration_margin_deg_s2: margin to the acceleration limit; negative if it is exceeded.
    """

    forbidden_steps: tuple[int, ...]
    clearance_deg: float
    speed_margin_deg_s: float
    acceleration_margin_deg_s2: float

    @property
    def within_limits(self) -> bool:
        """Whether no limit is exceeded by more than rounding."""
        return self.speed_margin_deg_s >= -ROUNDING and self.acceleration_margin_deg_s2 >= -ROUNDING

    @property
    def is_executable(self) -> bool:
        """Whether the table can execute the plan without touching a forbidden region."""
        return self.within_limits and not self.forbidden_steps


def verify(problem: Problem, plan: Plan) -> Verification:
    """Check a plan for its execution. In a pause only the end of the step counts."""
    limits = problem.limits
    return Verification(
        forbidden_steps=_forbidden_steps(problem, plan),
        clearance_deg=min(
            problem.map.forbidden_distance_deg(k, float(angle_deg)) for k, angle_deg in enumerate(plan.angles_deg)
        ),
        speed_margin_deg_s=limits.speed_deg_s - float(np.abs(plan.speeds_deg_s).max()),
        acceleration_margin_deg_s2=limits.acceleration_deg_s2 - float(np.abs(plan.accelerations_deg_s2).max()),
    )


def _forbidden_steps(problem: Problem, plan: Plan) -> tuple[int, ...]:
    terms, paused, waiting = problem.terms, {pause.step for pause in plan.pauses}, plan.waiting
    forbidden = []
    for k, acceleration in enumerate(plan.accelerations_deg_s2):
        if k in paused:
            is_allowed = column_value(terms.values, terms.epsilon, k + 1, plan.angles_deg[k + 1]) > terms.epsilon
        else:
            state = plan.angles_deg[k], 0.0 if k in waiting else plan.speeds_deg_s[k], acceleration
            is_allowed = step_is_allowed(terms.runs, k, *state, terms.step_s)
        if not is_allowed:
            forbidden.append(k)
    last = len(plan.accelerations_deg_s2) - 1
    halts = (min(location, last) for location in waiting if not _may_halt(terms, plan, location))
    return tuple(sorted({*forbidden, *halts}))


def _may_halt(terms: Terms, plan: Plan, location: int) -> bool:
    """Return whether the table may come to rest at the angle of a location, which it passes."""
    speed = plan.speeds_deg_s[location]
    way_deg = 0.5 * speed * abs(speed) / terms.acceleration_limit_deg_s2
    return bool(halt_is_allowed(terms.values, terms.epsilon, location, plan.angles_deg[location], way_deg, 0.0))
