"""Plans that the arm can follow.

If the arm cannot follow a planner's own plan, a search that includes the turns of the joints finds another.
"""

from collections.abc import Iterator
from functools import wraps

import numpy as np

from planner.arrays import BoolArray
from planner.plans.arm_motion import arm_motion
from planner.plans.arm_on_path import ArmOnPath
from planner.plans.plan import Infeasibility, NoPlan, Outcome, Plan, Planner, make_plan, motion_of
from planner.plans.problem import Problem
from planner.search.joint_turns import Margin, lay_out_turns
from planner.search.lattice import Lattice, speed_unit
from planner.search.lattice_choice import turn_lattice
from planner.search.node_joints import node_joints
from planner.search.turn_search import MOST_SPEEDS, NotFound, find_path
from planner.table.motion import Motion

# A motion of minimum cost runs along a limit, so the first search keeps a distance from the limits. If it finds
# nothing, the others use the full range.
COMFORTABLE, TIGHT = Margin(5.0, 0.95), Margin(1e-6, 1.0 - 1e-6)

# Maximum number of speeds in each direction of the lattices, and of steps per sample of a column.
SPEED_COUNTS = 20, 32
WORK_PER_SAMPLE = 40_000

# The tubes around a plan for refinement, in each direction; from one pass to the next they are half as wide.
TUBE_Q, TUBE_SPEEDS, PASSES = 24, 6, 6


def obeying_the_arm(planner: Planner) -> Planner:
    """Return the planner with other plans if the arm of the problem cannot follow its own."""

    @wraps(planner)
    def plan(problem: Problem) -> Outcome:
        outcome = planner(problem)
        if problem.arm is None or isinstance(outcome, NoPlan) or arm_motion(problem.arm, outcome).step is None:
            return outcome
        return plan_with_turns(problem, problem.arm, outcome)

    return plan


def plan_with_turns(problem: Problem, on_path: ArmOnPath, followed: Plan) -> Outcome:
    """Return the cheapest motion that the arm can follow on the first lattice with such a motion, refined.

    Args:
        problem: the problem.
        on_path: the arm.
        followed: a plan that the arm cannot follow; the result has its name.
    """
    reached = NotFound(0, None)
    for lattice, margins in lattices(problem, followed):
        joints, starts = node_joints(on_path, lattice), start_states(problem, lattice)
        for margin in margins:
            turns = lay_out_turns(on_path.arm, joints, problem.step_s, margin)
            found = find_path(problem, lattice, joints, turns, starts)
            if isinstance(found, NotFound):
                reached = max(reached, found, key=lambda each: each.location)
                continue
            plan = make_plan(problem, followed.planner, *found)
            if arm_motion(on_path, plan).step is None:
                return refine_with_turns(problem, on_path, plan, margin, 0.5 * lattice.node_deg)
    return NoPlan(followed.planner, Infeasibility.ARM, reached.location, reached.limit)


def lattices(problem: Problem, plan: Plan) -> Iterator[tuple[Lattice, tuple[Margin, ...]]]:
    """Yield lattices over the whole turn, and the margins for each search: around rest, around a plan, finer."""
    coarse, fine = SPEED_COUNTS
    for speed_count, reference, margins in (
        (coarse, None, (COMFORTABLE, TIGHT)),
        (coarse, motion_of(plan), (TIGHT,)),
        (fine, None, (TIGHT,)),
    ):
        lattice = turn_lattice(problem, speed_count, WORK_PER_SAMPLE * problem.map.angle_count, reference)
        if lattice is not None and 2 * lattice.half_count + 1 <= MOST_SPEEDS:
            yield lattice, margins


def start_states(problem: Problem, lattice: Lattice) -> BoolArray:
    """Return the states (n_speeds, n_q) of the first column that are the problem's start."""
    i = np.arange(-lattice.half_count, lattice.half_count + 1)[:, np.newaxis]
    nodes = 2 * (np.arange(lattice.q_count) + lattice.first_q) + i
    starts = np.ones(nodes.shape, dtype=np.bool_)
    angle_deg, speed_deg_s = lattice.reference.angles_deg[0], lattice.reference.speeds_deg_s[0]
    if problem.start_speed_deg_s is not None:
        speeds_deg_s = speed_deg_s + i * speed_unit(lattice, problem.step_s)
        starts &= np.abs(speeds_deg_s - problem.start_speed_deg_s) < _SAME
    if problem.start_angle_deg is not None:
        starts &= np.abs(angle_deg + nodes * lattice.node_deg - problem.start_angle_deg) < _SAME
    return starts


# Rounding error of a start, in deg and deg/s.
_SAME = 1e-9


def refine_with_turns(problem: Problem, on_path: ArmOnPath, plan: Plan, margin: Margin, node_deg: float) -> Plan:
    """Return a plan of at most the same cost that the arm can follow within the same margin.

    See `iterative_dynamic_programming.py`: searches in increasingly narrow tubes around the plan.
    """
    for halvings in range(PASSES):
        tube = Lattice(motion_of(plan), node_deg / 2**halvings, TUBE_SPEEDS, -TUBE_Q, 2 * TUBE_Q + 1, is_closed=False)
        joints = node_joints(on_path, tube)
        turns = lay_out_turns(on_path.arm, joints, problem.step_s, margin)
        found = find_path(problem, tube, joints, turns, start_states(problem, tube))
        if isinstance(found, Motion):
            finer = make_plan(problem, plan.planner, *found)
            if finer.cost.total < plan.cost.total and arm_motion(on_path, finer).step is None:
                plan = finer
    return plan
