"""Refine a plan by repeated dynamic programming in a tube around it, on increasingly fine lattices (Luus, 1990).

The lattice is centered on the plan itself. Offset 0 is the plan, so a pass can never lose it; a pass is kept only if
the exact cost decreases. In the end, no grid limits the result, only the path that the plan takes around obstacles.
"""

from collections.abc import Callable

from planner.plans.plan import Plan, make_plan, motion_of
from planner.plans.problem import Problem
from planner.search.lattice import Lattice
from planner.search.lattice_search import best_motion

# The tube: speeds in each direction, and q from -Q_COUNT / 2 up. Eight single-precision numbers are one vector.
SPEEDS_EACH_WAY = 4
Q_COUNT = 16

PASSES = 4

# The spacing stays the same while a pass gains more than this share.
LARGE_GAIN = 0.01
MOST_PASSES = 12


def any_plan(_plan: Plan) -> bool:
    """Accept every plan."""
    return True


def refine(problem: Problem, plan: Plan, node_deg: float, accepts: Callable[[Plan], bool] = any_plan) -> Plan:
    """Return a plan of at most the same cost, with the same name.

    Args:
        problem: the problem.
        plan: the initial plan, without pauses.
        node_deg: initial spacing, halved from pass to pass.
        accepts: an additional condition for a plan; a pass with a refused plan is not kept.
    """
    passes = 0
    for _ in range(MOST_PASSES):
        better = best_around(problem, plan, tube(plan, node_deg))
        is_kept = better.cost.total < plan.cost.total and accepts(better)
        gain = plan.cost.total - better.cost.total if is_kept else 0.0
        plan = better if is_kept else plan
        if gain < LARGE_GAIN * plan.cost.total:
            node_deg *= 0.5
            passes += 1
        if passes == PASSES:
            break
    return plan


def tube(plan: Plan, node_deg: float, speeds_each_way: int = SPEEDS_EACH_WAY, q_count: int = Q_COUNT) -> Lattice:
    """Return the lattice of the states near a plan."""
    return Lattice(motion_of(plan), node_deg, speeds_each_way, -q_count // 2, q_count, is_closed=False)


def best_around(problem: Problem, plan: Plan, lattice: Lattice) -> Plan:
    """Return the best plan of a lattice around a plan: that plan if none is cheaper."""
    motion = best_motion(problem, lattice)
    if motion is None:
        return plan
    better = make_plan(problem, plan.planner, *motion)
    return better if better.cost.total < plan.cost.total else plan
