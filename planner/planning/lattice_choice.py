"""Which lattice to search: fine enough for the limits, small enough for the time there is."""

import math
from collections.abc import Iterator

from planner.planning.lattice import Lattice, speed_unit
from planner.planning.problem import Problem
from planner.planning.reference_motion import reference_motion
from planner.table.motion import Limits, Motion

# A rounding error below this does not lose a speed.
ROUNDING = 1e-9

# Share of the greatest speed that a speed of the lattice must reach: nearly all of it, or all of it.
NEARLY, EXACTLY = 0.97, 1.0 - ROUNDING

# 200 MB.
MOST_STATES = 50_000_000


def turn_lattice(
    problem: Problem, speed_count: int, work: int, reference: Motion | None = None, share: float = NEARLY
) -> Lattice | None:
    """Return the coarsest lattice around the turn with at least so many speeds each way; None where all are too large.

    Its nodes at rest are the samples of the map, a multiple of them, or, where samples are closer than needed, every
    second, third .. sample. The acceleration limit lies at least two speeds away, or one where two are too many
    for `work`.

    Args:
        problem: what is to be crossed.
        speed_count: speeds each way, at least.
        work: steps per column, at most.
        reference: motion to lay the lattice around; without one, that of `reference_motion`.
        share: of the greatest speed that can occur, at least so much is a speed.
    """
    motion = reference_motion(problem) if reference is None else reference
    for least_reach in (2, 1):
        for rests in _rests_per_turn(problem.map.angle_count):
            unit_deg_s = 360.0 / rests / problem.step_s
            half_count = math.floor(problem.attainable_speed_deg_s / unit_deg_s + ROUNDING)
            reach = math.floor(problem.limits.acceleration_deg_s2 * problem.step_s / unit_deg_s + ROUNDING)
            speeds = 2 * half_count + 1
            if rests * speeds * min(2 * reach + 1, speeds) > work:
                break
            if rests * speeds * problem.map.location_count > MOST_STATES:
                break
            reaches = half_count * unit_deg_s >= share * problem.attainable_speed_deg_s
            if half_count >= speed_count and reach >= least_reach and reaches:
                return Lattice(motion, 180.0 / rests, half_count, 0, rests, is_closed=True)
    return None


def with_limits_rounded_up(lattice: Lattice, problem: Problem) -> Lattice:
    """Return the lattice with one speed more each way where its last one is below the greatest that can occur."""
    unit_deg_s = speed_unit(lattice, problem.step_s)
    return lattice._replace(half_count=math.ceil(problem.attainable_speed_deg_s / unit_deg_s - ROUNDING))


def limits_rounded_up(lattice: Lattice, problem: Problem) -> Limits:
    """Return the limits, rounded up to what steps of the lattice do."""
    unit_deg_s, limits = speed_unit(lattice, problem.step_s), problem.limits
    return Limits(
        unit_deg_s * math.ceil(limits.speed_deg_s / unit_deg_s - ROUNDING),
        unit_deg_s * math.ceil(limits.acceleration_deg_s2 * problem.step_s / unit_deg_s - ROUNDING) / problem.step_s,
    )


def _rests_per_turn(sample_count: int) -> Iterator[int]:
    """Yield how many angles of rest a turn may have, ascending: a part of the samples, all, or a multiple."""
    yield from (count for count in range(1, sample_count) if sample_count % count == 0)
    yield from (sample_count * multiple for multiple in range(1, 10_000))
