"""The result of a planner: a `Plan`, or `NoPlan` with the reason."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import NamedTuple

import numpy as np

from planner.arrays import BoolArray, FloatArray
from planner.kernel import kernel
from planner.map.config_map import column_value
from planner.plans.problem import Problem, Terms
from planner.reasons import Reason
from planner.table.cost import PathCost, acceleration_cost, speed_cost, value_cost
from planner.table.motion import Motion


class Pause(NamedTuple):
    """The scan stops: retract the probe, turn the table from rest to rest, approach again.

    It is between location `step` and `step + 1`; the plan continues from rest at `to_angle_deg`.
    """

    step: int
    from_angle_deg: float
    to_angle_deg: float
    configuration: str | None = None
    """The configuration of the arm from there on; None: it does not change."""


class Wait(NamedTuple):
    """The table comes to rest at the angle of a location, and the arm waits there before the scan goes on from rest.

    A table that arrives in motion brakes at its limit, passes the angle and comes back.
    """

    location: int
    duration_s: float


class Infeasibility(Enum):
    """The reason why there is no plan."""

    BLOCKED_LOCATION = "a scan location has no allowed table angle"
    START_FORBIDDEN = "the start is in a forbidden region"
    UNREACHABLE = "no motion within the limits avoids the forbidden regions"
    """This is proved."""
    NOT_FOUND = "none found: neither a motion that avoids the forbidden regions, nor a proof that there is none"
    ARM = "no motion was found that the arm can follow"


@dataclass(frozen=True)
class NoPlan:
    """An expected failure.

    Attributes:
        planner: name of the planner.
        infeasibility: kind of the failure.
        location: the scan location of the failure, if there is one.
        joint: the joint limit of the failure, if there is one.
    """

    planner: str
    infeasibility: Infeasibility
    location: int | None = None
    joint: Reason | None = None

    @property
    def reason(self) -> str:
        """The reason in one sentence."""
        joint = "" if self.joint is None else f"{self.joint.label}, "
        where = "" if self.location is None else f" ({joint}location {self.location})"
        return f"{self.planner}: {self.infeasibility.value}{where}"


@dataclass(frozen=True, eq=False)
class Plan:
    """The motion of the table along a scan path.

    Eq. (3) and (4) are satisfied exactly (to rounding) in every step except those of `pauses`, where the table stops.

    Attributes:
        planner: name of the planner.
        configuration: name of the arm configuration, "" if the map has none.
        step_s: time of one step.
        angles_deg: (n + 1,) unwrapped table angle at each location.
        speeds_deg_s: (n + 1,) speed at each location.
        accelerations_deg_s2: (n,) acceleration of each step, 0 in a pause.
        cost: Eq. (7) by term.
        pauses: the pauses of the scan.
        waits: the waits of the scan at rest, in the order of the locations.
        computing_time_s: duration of planning, if the caller measured it.
    """

    planner: str
    configuration: str
    step_s: float
    angles_deg: FloatArray
    speeds_deg_s: FloatArray
    accelerations_deg_s2: FloatArray
    cost: PathCost
    pauses: tuple[Pause, ...] = ()
    waits: tuple[Wait, ...] = ()
    computing_time_s: float | None = field(default=None, compare=False)

    def turned(self, turns: int) -> "Plan":
        """Return the same motion, full turns of the table farther."""
        shifted_deg = 360.0 * turns
        pauses = tuple(
            pause._replace(
                from_angle_deg=pause.from_angle_deg + shifted_deg, to_angle_deg=pause.to_angle_deg + shifted_deg
            )
            for pause in self.pauses
        )
        return replace(self, angles_deg=self.angles_deg + shifted_deg, pauses=pauses)

    @property
    def waiting(self) -> frozenset[int]:
        """The locations from which the scan goes on from rest after a wait."""
        return frozenset(wait.location for wait in self.waits)

    @property
    def configurations(self) -> list[str]:
        """The configuration of the arm at each location."""
        names = [self.configuration] * len(self.angles_deg)
        for pause in self.pauses:
            if pause.configuration is not None:
                names[pause.step + 1 :] = [pause.configuration] * (len(names) - pause.step - 1)
        return names


Outcome = Plan | NoPlan
Planner = Callable[[Problem], Outcome]


def path_cost(
    problem: Problem,
    angles_deg: FloatArray,
    speeds_deg_s: FloatArray,
    accelerations_deg_s2: FloatArray,
    pauses: Sequence[Pause] = (),
) -> PathCost:
    """Return Eq. (7) of a motion; each paused step costs C_pen instead of the terms of Eq. (5)."""
    terms = problem.terms
    moving = np.ones(problem.step_count, dtype=np.bool_)
    moving[[pause.step for pause in pauses]] = False
    return PathCost(
        *_sum_costs(terms, moving, angles_deg, speeds_deg_s, accelerations_deg_s2), terms.pause_cost * len(pauses)
    )


@kernel
def _sum_costs(
    terms: Terms, moving: BoolArray, angles_deg: FloatArray, speeds_deg_s: FloatArray, accelerations_deg_s2: FloatArray
) -> tuple[float, float, float]:
    acceleration, speed, value = 0.0, 0.0, 0.0
    for k in range(len(accelerations_deg_s2)):
        value += value_cost(column_value(terms.values, terms.epsilon, k + 1, angles_deg[k + 1]))
        if moving[k]:
            acceleration += acceleration_cost(terms.acceleration_weight, accelerations_deg_s2[k])
            speed += speed_cost(terms.speed_weight, speeds_deg_s[k + 1])
    return acceleration, speed, value


def make_plan(
    problem: Problem,
    planner: str,
    angles_deg: FloatArray,
    speeds_deg_s: FloatArray,
    accelerations_deg_s2: FloatArray,
    pauses: Sequence[Pause] = (),
) -> Plan:
    """Return the motion as a plan, with its cost."""
    for array in (angles_deg, speeds_deg_s, accelerations_deg_s2):
        array.setflags(write=False)
    return Plan(
        planner=planner,
        configuration=str(problem.map.metadata.get("configuration", "")),
        step_s=problem.step_s,
        angles_deg=angles_deg,
        speeds_deg_s=speeds_deg_s,
        accelerations_deg_s2=accelerations_deg_s2,
        cost=path_cost(problem, angles_deg, speeds_deg_s, accelerations_deg_s2, pauses),
        pauses=tuple(pauses),
    )


def obvious_infeasibility(problem: Problem, planner: str) -> NoPlan | None:
    """Return why the map cannot be crossed, if its columns alone show this."""
    blocked = problem.map.blocked_locations
    if blocked:
        return NoPlan(planner, Infeasibility.BLOCKED_LOCATION, blocked[0])
    angle = problem.start_angle_deg
    if angle is not None and not problem.map.is_allowed(0, angle):
        return NoPlan(planner, Infeasibility.START_FORBIDDEN, 0)
    return None


def motion_of(plan: Plan) -> Motion:
    """Return the motion of a plan."""
    return Motion(plan.angles_deg.copy(), plan.speeds_deg_s.copy(), plan.accelerations_deg_s2.copy())


def greedy_start(problem: Problem) -> tuple[float, float]:
    """Return the start for a planner that does not compare starts: if free, the angle with maximum value, at rest."""
    angle = problem.start_angle_deg
    if angle is None:
        angle = float(problem.map.angles_deg[np.argmax(problem.map.values[0])])
    return float(angle), float(problem.start_speed_deg_s or 0.0)
