"""The cost of a path across the map: Eq. (5), (6) and (7)."""

import math
from typing import NamedTuple

from planner.kernel import kernel
from planner.table.motion import Limits


class Weights(NamedTuple):
    """k_a and k_omega of Eq. (5)."""

    acceleration: float
    speed: float


class PathCost(NamedTuple):
    """Eq. (7) by term. `pauses` is not in the paper: each stop of the scan costs C_pen (`pause_cost`)."""

    acceleration: float
    speed: float
    value: float
    pauses: float = 0.0

    @property
    def total(self) -> float:
        """Eq. (7) plus the pauses."""
        return self.acceleration + self.speed + self.value + self.pauses


def default_weights(limits: Limits) -> Weights:
    """Return the weights for which the maximum acceleration and the maximum speed each cost 0.1 per step."""
    return Weights(0.1 / limits.acceleration_deg_s2**2, 0.1 / limits.speed_deg_s**2)


@kernel
def acceleration_cost(weight: float, acceleration_deg_s2: float) -> float:
    """Return the first term of Eq. (5) for one step."""
    return weight * acceleration_deg_s2 * acceleration_deg_s2


@kernel
def speed_cost(weight: float, next_speed_deg_s: float) -> float:
    """Return the second term of Eq. (5) for one step: it uses the speed at the step's *end*."""
    return weight * next_speed_deg_s * next_speed_deg_s


@kernel
def value_cost(value: float) -> float:
    """Return the term of Eq. (6) for one location."""
    return 1.0 - value


def greatest_step_cost(weights: Weights, limits: Limits) -> float:
    """Return the maximum cost of one step: both limits reached, at a location with f_R = 0."""
    return (
        acceleration_cost(weights.acceleration, limits.acceleration_deg_s2)
        + speed_cost(weights.speed, limits.speed_deg_s)
        + value_cost(0.0)
    )


def pause_cost(weights: Weights, limits: Limits) -> float:
    """Return C_pen of `evalpath`, for a step into the forbidden region: above the maximum cost of an allowed step."""
    return 2.0 * greatest_step_cost(weights, limits)


def costs_overflow(weights: Weights, limits: Limits, location_count: int) -> bool:
    """Return whether the cost of a path with this number of locations may overflow a double."""
    return not math.isfinite(pause_cost(weights, limits) * location_count)
