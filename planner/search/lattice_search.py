"""The best path through a lattice: follow its cost-to-go (`lattice_cost_to_go.py`) forward."""

import numpy as np

from planner.arrays import CostArray, IndexArray
from planner.kernel import kernel
from planner.map.config_map import column_value, wrapped
from planner.plans.crossing import step_is_allowed
from planner.plans.problem import Problem, Terms
from planner.search.lattice import ANY_COST, UNREACHABLE, Lattice, cost_unit, motion_along, speed_unit
from planner.search.lattice_cost_to_go import cost_to_go, steps_from
from planner.table.cost import acceleration_cost, speed_cost, value_cost
from planner.table.motion import Limits, Motion


def best_motion(problem: Problem, lattice: Lattice, limits: Limits | None = None) -> Motion | None:
    """Return the best motion of a lattice from the problem's start; None if it has none.

    Args:
        problem: the problem.
        lattice: the lattice; its reference has the problem's start, if that is given.
        limits: limits that replace the problem's.
    """
    terms = problem.terms
    if limits is not None:
        terms = terms._replace(
            speed_limit_deg_s=limits.speed_deg_s, acceleration_limit_deg_s2=limits.acceleration_deg_s2
        )
    costs = cost_to_go(terms, lattice)
    q, i = _best_start(costs[0], lattice, problem.start_angle_deg is None, problem.start_speed_deg_s is None)
    if costs[0, i + lattice.half_count, (q - lattice.first_q) % lattice.q_count] >= ANY_COST:
        return None
    speeds = _follow(terms, lattice, costs, q, i)
    return motion_along(lattice, q, speeds, problem.step_s) if len(speeds) == len(costs) else None


@kernel
def _best_start(costs: CostArray, lattice: Lattice, angle_is_free: bool, speed_is_free: bool) -> tuple[int, int]:
    """Return q and i of the best start state: node 0 if the angle is given, speed 0 if the speed is given."""
    best_q, best_i, least = 0, 0, UNREACHABLE
    for s in range(len(costs)):
        i = s - lattice.half_count
        if i != 0 and not speed_is_free:
            continue
        for place in range(lattice.q_count):
            q = place + lattice.first_q
            at_start = (2 * q + i) % (2 * lattice.q_count) == 0 if lattice.is_closed else 2 * q + i == 0
            if (angle_is_free or at_start) and costs[s, place] < least:
                best_q, best_i, least = q, i, costs[s, place]
    return best_q, best_i


@kernel
def _follow(terms: Terms, lattice: Lattice, costs: CostArray, q: int, i: int) -> IndexArray:
    """Return the speeds of the best path from a state of column 0; fewer if no step continues."""
    speeds = np.empty(len(costs), dtype=np.int64)
    speeds[0] = i
    for k in range(len(costs) - 1):
        speeds[k + 1] = _best_step(terms, lattice, costs, k, q, speeds[k])
        if speeds[k + 1] > lattice.half_count:
            return speeds[: k + 1]
        q += speeds[k]
    return speeds


@kernel
def _best_step(terms: Terms, lattice: Lattice, costs: CostArray, column: int, q: int, i: int) -> int:
    """Return the speed j at the end of the best step from a state; one beyond the last if there is none."""
    reference, unit = lattice.reference, speed_unit(lattice, terms.step_s)
    angle = reference.angles_deg[column] + (2 * q + i) * lattice.node_deg
    speed = reference.speeds_deg_s[column] + i * unit
    place = q + i - lattice.first_q
    place = wrapped(place, lattice.q_count) if lattice.is_closed else place
    best, least = lattice.half_count + 1, np.inf
    first, last = steps_from(terms, lattice, column, i)
    for j in range(first, last + 1):
        acceleration = reference.accelerations_deg_s2[column] + (j - i) * unit / terms.step_s
        if not 0 <= place < lattice.q_count or costs[column + 1, j + lattice.half_count, place] >= ANY_COST:
            continue
        if not step_is_allowed(terms.runs, column, angle, speed, acceleration, terms.step_s):
            continue
        later = reference.speeds_deg_s[column + 1] + j * unit
        end = reference.angles_deg[column + 1] + (2 * (q + i) + j) * lattice.node_deg
        cost = acceleration_cost(terms.acceleration_weight, acceleration) + speed_cost(terms.speed_weight, later)
        cost += value_cost(column_value(terms.values, terms.epsilon, column + 1, end))
        cost += costs[column + 1, j + lattice.half_count, place] * cost_unit(terms)
        if cost < least:
            best, least = j, cost
    return best
