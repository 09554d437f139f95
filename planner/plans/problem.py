"""The problem for a planner: the map, the time step, limits, weights and the start."""

import math
from dataclasses import dataclass, field
from typing import NamedTuple

from planner.arrays import FloatArray
from planner.errors import PlannerError
from planner.map.config_map import ConfigurationMap
from planner.plans.arm_on_path import ArmOnPath
from planner.plans.crossing import RunArray, free_runs, free_runs_down
from planner.table.cost import Weights, costs_overflow, default_weights, greatest_step_cost, pause_cost
from planner.table.motion import Limits


class ProblemError(PlannerError):
    """A problem with invalid values."""


class Terms(NamedTuple):
    """A problem as arrays for the compiled kernels; `runs` and `runs_down` are from `free_runs`, up and down."""

    values: FloatArray
    epsilon: float
    runs: RunArray
    runs_down: RunArray
    step_s: float
    speed_limit_deg_s: float
    acceleration_limit_deg_s2: float
    acceleration_weight: float
    speed_weight: float
    pause_cost: float


@dataclass(frozen=True, eq=False)
class Problem:
    """Cross `map` from its first to its last column, one column per `step_s`.

    Attributes:
        map: f_R along the scan path, for one arm configuration.
        step_s: time from one scan location to the next.
        limits: maximum speed and acceleration of the table.
        weights: k_a and k_omega of Eq. (5); None: the default for the limits.
        start_angle_deg: table angle at the first column; None: any angle.
        start_speed_deg_s: table speed there; None: any speed.
        arm: the arm that has to follow; None: plan only for the table.
    """

    map: ConfigurationMap
    step_s: float = 0.1
    limits: Limits = field(default_factory=Limits)
    weights: Weights | None = None
    start_angle_deg: float | None = None
    start_speed_deg_s: float | None = 0.0
    arm: ArmOnPath | None = None
    terms: Terms = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Check the values, and prepare the arrays for the kernels."""
        if self.map.location_count < 2:
            raise ProblemError("the map has 1 location; a path needs at least 2")
        _check_positive("time step", "s", self.step_s)
        _check_positive("speed limit", "deg/s", self.limits.speed_deg_s)
        _check_positive("acceleration limit", "deg/s2", self.limits.acceleration_deg_s2)
        weights = default_weights(self.limits) if self.weights is None else self.weights
        _check_weight("acceleration", "1/(deg/s2)^2", weights.acceleration)
        _check_weight("speed", "1/(deg/s)^2", weights.speed)
        if costs_overflow(weights, self.limits, self.map.location_count):
            raise ProblemError("the weights are so large that the cost of a path overflows; reduce them")
        self._check_start()
        terms = Terms(
            values=self.map.values,
            epsilon=self.map.epsilon,
            runs=free_runs(self.map.allowed),
            runs_down=free_runs_down(self.map.allowed),
            step_s=float(self.step_s),
            speed_limit_deg_s=float(self.limits.speed_deg_s),
            acceleration_limit_deg_s2=float(self.limits.acceleration_deg_s2),
            acceleration_weight=float(weights.acceleration),
            speed_weight=float(weights.speed),
            pause_cost=pause_cost(weights, self.limits),
        )
        object.__setattr__(self, "terms", terms)

    @property
    def step_count(self) -> int:
        """n: the number of steps from the first column to the last."""
        return self.map.location_count - 1

    @property
    def attainable_speed_deg_s(self) -> float:
        """The maximum possible speed along the path."""
        if self.start_speed_deg_s is None:
            return self.limits.speed_deg_s
        gain_deg_s = self.limits.acceleration_deg_s2 * self.step_s
        return min(self.limits.speed_deg_s, abs(self.start_speed_deg_s) + self.step_count * gain_deg_s)

    @property
    def greatest_step_cost(self) -> float:
        """The maximum cost of one allowed step."""
        return greatest_step_cost(Weights(self.terms.acceleration_weight, self.terms.speed_weight), self.limits)

    def _check_start(self) -> None:
        if self.start_angle_deg is not None and not math.isfinite(self.start_angle_deg):
            raise ProblemError(f"the start angle is {self.start_angle_deg}; allowed: any finite angle in degrees")
        speed = self.start_speed_deg_s
        if speed is not None and not abs(speed) <= self.limits.speed_deg_s:
            raise ProblemError(f"the start speed is {speed} deg/s; allowed: up to {self.limits.speed_deg_s} deg/s")


def _check_positive(name: str, unit: str, value: float) -> None:
    if not (math.isfinite(value) and value > 0.0):
        raise ProblemError(f"the {name} is {value} {unit}; allowed: any finite value above 0")


def _check_weight(name: str, unit: str, value: float) -> None:
    if not (math.isfinite(value) and value >= 0.0):
        raise ProblemError(f"the weight of the {name} is {value} {unit}; allowed: any finite value from 0 up")
