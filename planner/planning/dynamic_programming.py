"""The default planner: the best path of an exact lattice, refined until no grid limits it.

Where the lattice has no way, finer means take turns: a proof that there is none, the exact sets of crossable angles,
and a finer lattice. Each turn doubles the speeds that they use.
"""

from planner.planning.crossable_intervals import crossing_motion
from planner.planning.interpolated_planner import interpolated_plan
from planner.planning.iterative_dynamic_programming import best_around, refine, tube
from planner.planning.lattice import Lattice
from planner.planning.lattice_choice import limits_rounded_up, turn_lattice, with_limits_rounded_up
from planner.planning.lattice_search import best_motion
from planner.planning.plan import Infeasibility, NoPlan, Outcome, Plan, make_plan, motion_of, obvious_infeasibility
from planner.planning.problem import Problem
from planner.planning.unreachability_proof import first_unreachable_location
from planner.planning.verification import verify

NAME = "dynamic_programming"

# Speeds each way of the lattice, and its steps per sample of a column.
SPEED_COUNT = 8
WORK_PER_SAMPLE = 1_300

# The tube around a path that exceeds the limits.
WIDE_SPEEDS_EACH_WAY, WIDE_Q_COUNT = 8, 48

# Where that has no way: how often finer means are tried, and where they begin.
TURNS = 5
FINE_WORK_PER_SAMPLE = 20_000
FINE_SPEED_COUNT = 20
CELLS = 16
SPEEDS_PER_GAIN = 4


def dynamic_programming(problem: Problem) -> Outcome:
    """Return the plan of least cost, or why there is none.

    It costs at most what the best path of a lattice costs that has 20 speeds each way, to about a percent.
    """
    no_plan = obvious_infeasibility(problem, NAME)
    if no_plan is not None:
        return no_plan
    plan = first_plan(problem)
    return search_harder(problem) if plan is None else plan


def first_plan(problem: Problem) -> Plan | None:
    """Return the best plan of the lattice that there is time for, refined; None where that has none."""
    lattice = turn_lattice(problem, SPEED_COUNT, WORK_PER_SAMPLE * problem.map.angle_count)
    if lattice is not None:
        return lattice_plan(problem, lattice)
    plan = interpolated_plan(problem)
    return None if plan is None else refine(problem, plan, 0.25 * problem.map.angle_step_deg)


def lattice_plan(problem: Problem, lattice: Lattice) -> Plan | None:
    """Return the best plan of a lattice, refined.

    A lattice rounds the limits down to its own speeds, which may bar the best way around the forbidden regions. So the
    limits are first rounded up; where the best path then exceeds them, a tube around it is searched within the limits.
    Only where that costs more than the path had promised is the lattice searched within the limits, too.
    """
    tempting = best_motion(problem, with_limits_rounded_up(lattice, problem), limits_rounded_up(lattice, problem))
    if tempting is None:
        return None
    temptation = make_plan(problem, NAME, *tempting)
    node_deg = 0.5 * lattice.node_deg
    if verify(problem, temptation).within_limits:
        return refine(problem, temptation, node_deg)
    wide = tube(temptation, node_deg, WIDE_SPEEDS_EACH_WAY, WIDE_Q_COUNT)
    plans = []
    for around in (wide, lattice):
        motion = best_motion(problem, around)
        if motion is not None:
            plans.append(refine(problem, make_plan(problem, NAME, *motion), node_deg))
            if plans[-1].cost.total <= temptation.cost.total:
                break
    return min(plans, key=lambda plan: plan.cost.total, default=None)


def search_harder(problem: Problem) -> Outcome:
    """Return a plan or the proof that there is none, by finer and finer means."""
    for turn in range(TURNS):
        location = first_unreachable_location(problem, CELLS << turn)
        if location is not None:
            return NoPlan(NAME, Infeasibility.UNREACHABLE, location)
        motion = crossing_motion(problem, SPEEDS_PER_GAIN << turn)
        fine = turn_lattice(problem, FINE_SPEED_COUNT << turn, (FINE_WORK_PER_SAMPLE << turn) * problem.map.angle_count)
        plans = []
        if motion is not None:
            plans.append(_improved(problem, make_plan(problem, NAME, *motion)))
        if fine is not None and (plan := lattice_plan(problem, fine)) is not None:
            plans.append(plan)
        if plans:
            return min(plans, key=lambda plan: plan.cost.total)
    return NoPlan(NAME, Infeasibility.NOT_FOUND)


def _improved(problem: Problem, plan: Plan) -> Plan:
    """Return a plan that only avoids the forbidden regions, made good: first anywhere on the map, then nearby."""
    around = turn_lattice(problem, SPEED_COUNT, WORK_PER_SAMPLE * problem.map.angle_count, motion_of(plan))
    if around is None:
        return refine(problem, plan, 0.25 * problem.map.angle_step_deg)
    return refine(problem, best_around(problem, plan, around), 0.5 * around.node_deg)
