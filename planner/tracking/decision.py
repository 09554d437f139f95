"""One decision: the accelerations that the next step may have, from what is known, in the order of their cost."""

from collections.abc import Iterator
from typing import NamedTuple, Protocol

import numpy as np

from planner.arrays import CostArray, FloatArray, IndexArray
from planner.defaults import RAY_SHOOTING, RECEDING
from planner.kernel import kernel
from planner.planning.ray_shooting import Rays, ray_accelerations, ray_cost
from planner.planning.receding import TRIALS, OnlineStep, costs_at_rest, look_ahead, trial_cost
from planner.plans.crossing import RunArray
from planner.plans.problem import Terms
from planner.search.cost_to_go import CostToGo
from planner.tracking.rest_motion import NO_REST, rests_after
from planner.tracking.revealed_map import Window

# Brakings that come to rest after so many steps are among what is tried.
_BRAKINGS = 8


class Candidate(NamedTuple):
    """A step that may be taken: the table can come to rest after it, in `braking_steps` of equal braking."""

    acceleration_deg_s2: float
    braking_steps: int
    cost: float


class Method(Protocol):
    """How steps, and angles after a pause, are rated; all costs are from the window's first column on."""

    def accelerations_deg_s2(self, window: Window, speed_deg_s: float) -> FloatArray:
        """Return what may be tried, (n,); of equal costs, the first is taken."""

    def step_costs(
        self, online: OnlineStep, window: Window, angle_deg: float, speed_deg_s: float, accelerations: FloatArray
    ) -> FloatArray:
        """Return the (n,) cost of each acceleration."""

    def rest_costs(self, online: OnlineStep, window: Window, angle_deg: float) -> FloatArray:
        """Return the (n_angles,) cost of being at rest in column 1 after a pause, per sample; infinite: forbidden."""


class Receding:
    """The cost-to-go over the columns in view, as `planner.planning.receding` has it."""

    name = RECEDING

    def accelerations_deg_s2(self, window: Window, speed_deg_s: float) -> FloatArray:
        """Return 0 and accelerations over the range that both limits leave, those next to zero first."""
        terms = window.terms
        limit, ways = terms.acceleration_limit_deg_s2, np.array((-terms.speed_limit_deg_s, terms.speed_limit_deg_s))
        low, high = np.clip((ways - speed_deg_s) / terms.step_s, -limit, limit)
        trials = np.append(0.0, np.linspace(low, high, TRIALS - 1))
        trials = trials[np.argsort(np.abs(trials), kind="stable")]
        return np.concatenate((trials, _brakings(window, speed_deg_s)))

    def step_costs(
        self, online: OnlineStep, window: Window, angle_deg: float, speed_deg_s: float, accelerations: FloatArray
    ) -> FloatArray:
        """Return the cost of each step and of the best way on from its end."""
        return _receding_costs(window.terms, online, window.node_cost, window.sweep, angle_deg, speed_deg_s,
                               accelerations)  # fmt: skip

    def rest_costs(self, online: OnlineStep, window: Window, angle_deg: float) -> FloatArray:  # noqa: ARG002 - see Method
        """Return the cost of going on from each angle."""
        return _receding_rest_costs(online, window.node_cost, window.sweep, 0)


class RayShooting:
    """Algorithm 2: rays of constant acceleration; after a pause the nearest angle, as in Algorithm 1."""

    name = RAY_SHOOTING

    def __init__(self, rays: Rays | None = None) -> None:
        """Shoot `rays`."""
        self._rays = rays or Rays()

    def accelerations_deg_s2(self, window: Window, speed_deg_s: float) -> FloatArray:
        """Return the paper's set, and behind it the ways to brake, which cost more than any ray."""
        terms = window.terms
        rays = ray_accelerations(self._rays.rays, terms.acceleration_limit_deg_s2)
        return np.concatenate((rays, _brakings(window, speed_deg_s)))

    def step_costs(
        self, online: OnlineStep, window: Window, angle_deg: float, speed_deg_s: float, accelerations: FloatArray
    ) -> FloatArray:
        """Return the cost of each ray; the paper shoots no other, so a way to brake is the last resort."""
        nothing = CostToGo(online.grid, np.empty((0, *online.layers.shape[1:]), dtype=np.float32), 1.0)
        last = min(self._rays.horizon, window.last)
        costs = _ray_costs(window.terms, last, nothing, angle_deg, speed_deg_s, accelerations)
        costs[self._rays.rays :] = np.inf
        return costs

    def rest_costs(self, online: OnlineStep, window: Window, angle_deg: float) -> FloatArray:  # noqa: ARG002 - see Method
        """Return the way from the present angle."""
        count = window.terms.values.shape[1]
        ways = np.abs((np.arange(count) * 360.0 / count - angle_deg + 180.0) % 360.0 - 180.0)
        return np.where(window.terms.values[1] > window.terms.epsilon, ways, np.inf)


METHODS = {RECEDING: Receding, RAY_SHOOTING: RayShooting}


def safe_candidates(
    method: Method, online: OnlineStep, window: Window, angle_deg: float, speed_deg_s: float, margin_deg: float
) -> Iterator[Candidate]:
    """Yield the steps from a state after which the table can come to rest in view, the cheapest first.

    Args:
        method: how steps are rated.
        online: what stays the same from step to step.
        window: the known columns; the table is at the first.
        angle_deg: its angle.
        speed_deg_s: its speed.
        margin_deg: distance that is kept from what is forbidden.
    """
    if window.last < 1:
        return
    terms = window.terms
    most, least = (sign * terms.speed_limit_deg_s - speed_deg_s for sign in (1.0, -1.0))
    tried = method.accelerations_deg_s2(window, speed_deg_s)
    accelerations = np.clip(tried, least / terms.step_s, most / terms.step_s)
    rests = rests_after(terms, window.last, angle_deg, speed_deg_s, accelerations, margin_deg)
    if (rests == NO_REST).all():
        return
    costs = method.step_costs(online, window, angle_deg, speed_deg_s, accelerations)
    for i in _order(rests, costs, accelerations):
        yield Candidate(float(accelerations[i]), int(rests[i]), float(costs[i]))


def costs_of_starts(online: OnlineStep, window: Window) -> FloatArray:
    """Return (n_angles,) what it costs to start at rest at each sample of column 0; infinite where forbidden."""
    return np.where(
        window.terms.values[0] > window.terms.epsilon,
        _receding_rest_costs(online, window.node_cost, window.sweep, -1),
        np.inf,
    )


def _order(rests: IndexArray, costs: FloatArray, accelerations: FloatArray) -> list[int]:
    """Return the safe steps by cost; without a known cost, by their acceleration."""
    keys = np.where(np.isfinite(costs), costs, np.inf)
    order = np.lexsort((np.where(np.isinf(keys), np.abs(accelerations), 0.0), keys))
    return [int(i) for i in order if rests[i] != NO_REST]


def _brakings(window: Window, speed_deg_s: float) -> FloatArray:
    """Return the accelerations that bring the table to rest in some steps, within the limit."""
    rates = -speed_deg_s / (np.arange(1, _BRAKINGS + 1) * window.terms.step_s)
    return np.asarray(rates[np.abs(rates) <= window.terms.acceleration_limit_deg_s2])


@kernel
def _receding_costs(
    terms: Terms,
    online: OnlineStep,
    node_cost: CostArray,
    sweep: RunArray,
    angle_deg: float,
    speed_deg_s: float,
    accelerations: FloatArray,
) -> FloatArray:
    look_ahead(online, node_cost, sweep, 0, len(sweep))
    costs = np.empty(len(accelerations))
    for i in range(len(accelerations)):
        costs[i] = trial_cost(terms, online, 0, angle_deg, speed_deg_s, accelerations[i])
    return costs


@kernel
def _receding_rest_costs(online: OnlineStep, node_cost: CostArray, sweep: RunArray, column: int) -> FloatArray:
    look_ahead(online, node_cost, sweep, column, len(sweep))
    costs: FloatArray = costs_at_rest(online, node_cost, column)
    return costs


@kernel
def _ray_costs(
    terms: Terms, last: int, to_go: CostToGo, angle_deg: float, speed_deg_s: float, accelerations: FloatArray
) -> FloatArray:
    costs = np.empty(len(accelerations))
    for i in range(len(accelerations)):
        costs[i] = ray_cost(terms, accelerations[i], 0, last, to_go, angle_deg, speed_deg_s, np.inf)
    return costs
