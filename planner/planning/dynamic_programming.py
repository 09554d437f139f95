"""The default planner: the best path of an exact lattice, refined until no grid limits it.

If the lattice has no path, finer methods are used in turn: a proof that there is none, the exact sets of crossable
angles, and a finer lattice. Each round doubles the number of speeds.
"""

from dataclasses import replace
from typing import NamedTuple

from planner.defaults import DYNAMIC_PROGRAMMING
from planner.planning.interpolated_planner import interpolated_plan
from planner.planning.iterative_dynamic_programming import best_around, refine, tube
from planner.plans.plan import Infeasibility, NoPlan, Outcome, Plan, make_plan, obvious_infeasibility
from planner.plans.problem import Problem
from planner.plans.verification import verify
from planner.search.crossable_intervals import crossing_motion
from planner.search.lattice import Lattice
from planner.search.lattice_choice import EXACTLY, NEARLY, limits_rounded_up, turn_lattice, with_limits_rounded_up
from planner.search.lattice_search import best_motion
from planner.search.unreachability_proof import first_unreachable_location
from planner.table.motion import Motion

# The first lattice. Its minimum number of speeds in each direction. The share of the maximum speed that it must
# include, from the preferred to the minimum value. Its maximum number of steps per column, or in total on a short path.
SPEEDS = ((8, NEARLY), (8, 0.9), (5, 0.9), (3, 0.8))
WORK, TOTAL_WORK = 130_000, 13_000_000

# The total on a finer lattice, about a second.
MOST_WORK = 1_000_000_000

# The tube around a path that exceeds the limits.
WIDE_SPEEDS_EACH_WAY, WIDE_Q_COUNT = 8, 48

# The lower cost of that path is kept up to this share.
KEPT = 1.005


class Effort(NamedTuple):
    """The effort of the search if the first lattice has no path.

    Attributes:
        cells: cells of speed for the proof.
        speeds_per_gain: speeds of the crossable intervals.
        speed_count: speeds in each direction of the lattice.
        share: share of the maximum speed that the lattice must include.
        work: maximum number of steps of the lattice per column.
    """

    cells: int
    speeds_per_gain: int
    speed_count: int
    share: float
    work: int


EFFORTS = (
    Effort(32, 4, 20, NEARLY, 2_000_000),
    Effort(64, 8, 20, EXACTLY, 10_000_000),
    Effort(128, 16, 40, NEARLY, 10_000_000),
    Effort(256, 32, 40, EXACTLY, 20_000_000),
    Effort(512, 64, 60, NEARLY, 20_000_000),
)


def dynamic_programming(problem: Problem) -> Outcome:
    """Return the plan of minimum cost, or the reason why there is none.

    Its cost is at most that of the best path of a lattice with 20 speeds in each direction, within about a percent.
    """
    no_plan = obvious_infeasibility(problem, DYNAMIC_PROGRAMMING)
    if no_plan is not None:
        return no_plan
    plan = first_plan(problem)
    return search_harder(problem) if plan is None else plan


def first_plan(problem: Problem) -> Plan | None:
    """Return the best plan of the largest affordable lattice, refined; None if it has none."""
    lattice = first_lattice(problem)
    if lattice is not None:
        return lattice_plan(problem, lattice)
    plan = interpolated_plan(problem)
    return (
        None
        if plan is None
        else refine(problem, replace(plan, planner=DYNAMIC_PROGRAMMING), 0.25 * problem.map.angle_step_deg)
    )


def first_lattice(problem: Problem, reference: Motion | None = None) -> Lattice | None:
    """Return the largest affordable lattice; None if even a coarse one has too many steps."""
    work = max(WORK, TOTAL_WORK // problem.step_count)
    lattices = (turn_lattice(problem, count, work, reference, share) for count, share in SPEEDS)
    return next((lattice for lattice in lattices if lattice is not None), None)


def lattice_plan(problem: Problem, lattice: Lattice) -> Plan | None:
    """Return the best plan of a lattice, refined.

    A lattice rounds the limits down to its own speeds, which may exclude the best path around the forbidden regions. So
    the limits are first rounded up. If the best path then exceeds them, tubes around it are searched within the limits.
    Only if the result costs clearly more than that path is the whole lattice searched within the limits, too.
    """
    tempting = best_motion(problem, with_limits_rounded_up(lattice, problem), limits_rounded_up(lattice, problem))
    if tempting is None:
        return None
    temptation = make_plan(problem, DYNAMIC_PROGRAMMING, *tempting)
    node_deg = 0.5 * lattice.node_deg
    if verify(problem, temptation).within_limits:
        return refine(problem, temptation, node_deg)
    tubes = (tube(temptation, node_deg / part, WIDE_SPEEDS_EACH_WAY, WIDE_Q_COUNT) for part in (1, 2))
    plans = []
    for around in (*tubes, lattice):
        motion = best_motion(problem, around)
        if motion is not None:
            plans.append(refine(problem, make_plan(problem, DYNAMIC_PROGRAMMING, *motion), node_deg))
            if plans[-1].cost.total <= KEPT * temptation.cost.total:
                break
    return min(plans, key=lambda plan: plan.cost.total, default=None)


def search_harder(problem: Problem) -> Outcome:
    """Return a plan, or the proof that there is none, by increasingly fine methods, each with bounded effort."""
    for effort in EFFORTS:
        location = first_unreachable_location(problem, effort.cells)
        if location is not None:
            return NoPlan(DYNAMIC_PROGRAMMING, Infeasibility.UNREACHABLE, location)
        plans = [_plan_through_intervals(problem, effort), _plan_on_finer_lattice(problem, effort)]
        found = [plan for plan in plans if plan is not None]
        if found:
            return min(found, key=lambda plan: plan.cost.total)
    return NoPlan(DYNAMIC_PROGRAMMING, Infeasibility.NOT_FOUND)


def _plan_on_finer_lattice(problem: Problem, effort: Effort) -> Plan | None:
    work = min(effort.work, MOST_WORK // problem.step_count)
    lattice = turn_lattice(problem, effort.speed_count, work, share=effort.share)
    return None if lattice is None else lattice_plan(problem, lattice)


def _plan_through_intervals(problem: Problem, effort: Effort) -> Plan | None:
    """Return a plan through the crossable intervals, optimized: first anywhere on the map, then near it."""
    motion = crossing_motion(problem, effort.speeds_per_gain)
    if motion is None:
        return None
    plan = make_plan(problem, DYNAMIC_PROGRAMMING, *motion)
    around = first_lattice(problem, motion)
    if around is None:
        return refine(problem, plan, 0.25 * problem.map.angle_step_deg)
    return refine(problem, best_around(problem, plan, around), 0.5 * around.node_deg)
