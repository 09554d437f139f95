"""What a path across the map costs: Eq. (5), (6) and (7)."""

import math
from typing import NamedTuple

from planner.kernel import kernel
from planner.table.motion import Limits


class Weights(NamedTuple):
    """k_a and k_omega of Eq. (5)."""

    acceleration: float
    speed: float


class PathCost(NamedTuple):
    """Eq. (7) by term. `pauses` is not in the paper: each stop of the scan is charged C_pen (`pause_cost`)."""

    acceleration: float
    speed: float
    value: float
    pauses: float = 0.0

    @property
    def total(self) -> float:
        """Eq. (7), and the pauses."""
        return self.acceleration + self.speed + self.value + self.pauses


def default_weights(limits: Limits) -> Weights:
    """Return the weights at which the greatest acceleration, and the greatest speed, each cost 0.1 a step."""
    return Weights(0.1 / limits.acceleration_deg_s2**2, 0.1 / limits.speed_deg_s**2)


@kernel
def acceleration_cost(weight: float, acceleration_deg_s2: float) -> float:
    """Return the first term of Eq. (5) for one step."""
    return weight * acceleration_deg_s2 * acceleration_deg_s2


@kernel
def speed_cost(weight: float, next_speed_deg_s: float) -> float:
    """Return the second term of Eq. (5) for one step: it counts the speed at the step's *end*."""
    return weight * next_speed_deg_s * next_speed_deg_s


@kernel
def value_cost(value: float) -> float:
    """Return the term of Eq. (6) for one location."""
    return 1.0 - value


def greatest_step_cost(weights: Weights, limits: Limits) -> float:
    """Return what one step costs at most: both limits reached, at a location where f_R is 0."""
    return (
        acceleration_cost(weights.acceleration, limits.acceleration_deg_s2)
        + speed_cost(weights.speed, limits.speed_deg_s)
        + value_cost(0.0)
    )


def pause_cost(weights: Weights, limits: Limits) -> float:
    """Return C_pen of `evalpath`, for a step into the forbidden region: above the greatest cost of an allowed step."""
    return 2.0 * greatest_step_cost(weights, limits)


def costs_overflow(weights: Weights, limits: Limits, location_count: int) -> bool:
    """Return whether the cost of a path of so many locations may exceed what a double holds."""
    return not math.isfinite(pause_cost(weights, limits) * location_count)
