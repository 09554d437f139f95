"""Measure the default planner on every family: plans and proofs, cost, and CPU time before and after.

"Before" is the plan from the interpolated cost-to-go alone.
"""

import math
import time
from collections.abc import Callable, Sequence
from typing import NamedTuple, TextIO, TypeVar

import numpy as np

from planner.planning.dynamic_programming import dynamic_programming
from planner.planning.interpolated_planner import interpolated_plan
from planner.plans.plan import Infeasibility, NoPlan, Plan, make_plan
from planner.plans.problem import Problem
from planner.plans.verification import verify
from planner.search.lattice_choice import turn_lattice
from planner.search.lattice_search import best_motion
from planner.search.unreachability_proof import first_unreachable_location
from tools.bench.planner_families import FAMILIES, Family, around_a_motion

# The reference lattice: speeds in each direction, and any number of steps per column.
SPEED_COUNT, WORK = 20, 1_000_000_000

SUB_STEPS = 32

WIDTHS = (21, 5, 9, 13, 7, 10, 15, 15, 6, 5)

# Maps around known motions, and cells of speed for the proofs that are tried on each.
ATTACKS, CELL_COUNTS = 1000, (4, 32, 128)

Result = TypeVar("Result")


class Case(NamedTuple):
    """The result for one problem; a cost is infinite without a plan."""

    cost: float
    before: float
    optimum: float
    is_proved: bool
    is_executable: bool
    seconds: float
    seconds_before: float

    @property
    def is_missed(self) -> bool:
        """Whether another planner found a plan."""
        return math.isinf(self.cost) and min(self.before, self.optimum) < math.inf


def bench_default_planner(stream: TextIO) -> None:
    """Print a line for each family."""
    print(
        "\nThe default planner; cost / that of the best lattice path with 20 speeds each way, or / before", file=stream
    )
    upper = ("family", "found", "no motion", "a way exists,", "neither", "not", "/ lattice", "/ before", "CPU ms", "")
    lower = ("", "", "(proved)", "none found", "", "executable", "mean (max)", "mean (max)", "before", "now")
    print(f"{_row(upper)}\n{_row(lower)}", file=stream)
    for family in FAMILIES:
        print(_line(family), file=stream)
    _attack_proof(stream)


def _attack_proof(stream: TextIO) -> None:
    """Try to prove that maps cannot be crossed although a known motion crosses them."""
    proved = found = 0
    for seed in range(ATTACKS):
        problem = around_a_motion(seed).problem
        proved += any(first_unreachable_location(problem, cells) is not None for cells in CELL_COUNTS)
        found += isinstance(dynamic_programming(problem), Plan)
    print(f"{ATTACKS} maps around known motions: {found} plans found, {proved} proved impossible", file=stream)


def lattice_optimum(problem: Problem) -> Plan | None:
    """Return the best path of a lattice with at least 20 speeds in each direction; None if it has none."""
    lattice = turn_lattice(problem, SPEED_COUNT, WORK)
    motion = None if lattice is None else best_motion(problem, lattice)
    return None if motion is None else make_plan(problem, "lattice", *motion)


def measure(problem: Problem) -> Case:
    """Plan one problem in all three ways."""
    outcome, seconds = _timed(lambda: dynamic_programming(problem))
    before, seconds_before = _timed(lambda: interpolated_plan(problem))
    optimum = lattice_optimum(problem)
    proved = isinstance(outcome, NoPlan) and outcome.infeasibility is not Infeasibility.NOT_FOUND
    return Case(
        outcome.cost.total if isinstance(outcome, Plan) else math.inf,
        math.inf if before is None else before.cost.total,
        math.inf if optimum is None else optimum.cost.total,
        proved,
        not isinstance(outcome, Plan) or can_be_executed(problem, outcome),
        seconds,
        seconds_before,
    )


def can_be_executed(problem: Problem, plan: Plan) -> bool:
    """Return whether a plan obeys the limits and no sub-step is forbidden.

    This is checked by look-ups, without the crossing rule.
    """
    if not verify(problem, plan).within_limits:
        return False
    for k, acceleration in enumerate(plan.accelerations_deg_s2):
        for fraction in np.linspace(0.0, 1.0, SUB_STEPS + 1):
            t_s = fraction * plan.step_s
            angle_deg = plan.angles_deg[k] + plan.speeds_deg_s[k] * t_s + 0.5 * acceleration * t_s * t_s
            if not problem.map.is_allowed(k + fraction, angle_deg):
                return False
    return True


def _timed(function: Callable[[], Result]) -> tuple[Result, float]:
    """Return the result of a call, and the shorter CPU time of two: the first may compile."""
    times = []
    for _ in range(2):
        before = time.process_time()
        result = function()
        times.append(time.process_time() - before)
    return result, min(times)


def _line(family: Family) -> str:
    cases = [measure(family.problem(seed)) for seed in range(family.map_count)]
    found = [case for case in cases if case.cost < math.inf]
    milliseconds = 1e3 * float(np.median([case.seconds for case in cases]))
    milliseconds_before = 1e3 * float(np.median([case.seconds_before for case in cases]))
    missed = sum(case.is_missed for case in cases)
    neither = sum(not case.is_proved and not case.is_missed for case in cases) - len(found)
    values = (
        family.name,
        str(len(found)),
        str(sum(case.is_proved for case in cases)),
        str(missed),
        str(neither),
        str(sum(not case.is_executable for case in cases)),
        _ratios([case.cost / case.optimum for case in found if case.optimum < math.inf]),
        _ratios([case.cost / case.before for case in found if case.before < math.inf]),
        f"{milliseconds_before:.1f}",
        f"{milliseconds:.1f}",
    )
    return _row(values)


def _row(cells: Sequence[str]) -> str:
    first, *others = (f"{cell:>{width}}" for cell, width in zip(cells, WIDTHS, strict=True))
    return " ".join((cells[0].ljust(len(first)), *others))


def _ratios(ratios: list[float]) -> str:
    return f"{np.mean(ratios):.4f} ({np.max(ratios):.3f})" if ratios else "-"
