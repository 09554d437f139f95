"""Choose a lattice that is fine enough for the limits and small enough for the available time."""

import math
from collections.abc import Iterator

from planner.plans.problem import Problem
from planner.search.lattice import Lattice, speed_unit
from planner.search.reference_motion import reference_motion
from planner.table.motion import Limits, Motion

# A rounding error below this does not lose a speed.
ROUNDING = 1e-9

# Share of the maximum speed that a speed of the lattice must reach: nearly all of it, or all of it.
NEARLY, EXACTLY = 0.97, 1.0 - ROUNDING

# 200 MB.
MOST_STATES = 50_000_000


def turn_lattice(
    problem: Problem, speed_count: int, work: int, reference: Motion | None = None, share: float = NEARLY
) -> Lattice | None:
    """Return the coarsest lattice around the turn with at least the given number of speeds in each direction.

    The result is None if all are too large.

    Its nodes at rest are the samples of the map or a multiple of them. If samples are closer than needed, they are
    every second, third .. sample. The acceleration limit is at least two speeds away, or one if two are too many for
    `work`.

    Args:
        problem: the problem.
        speed_count: minimum number of speeds in each direction.
        work: maximum number of steps per column.
        reference: motion at the center of the lattice; by default, that of `reference_motion`.
        share: minimum share of the maximum possible speed that is a speed of the lattice.
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
    """Return the lattice with one more speed in each direction if its last one is below the maximum possible speed."""
    unit_deg_s = speed_unit(lattice, problem.step_s)
    return lattice._replace(half_count=math.ceil(problem.attainable_speed_deg_s / unit_deg_s - ROUNDING))


def limits_rounded_up(lattice: Lattice, problem: Problem) -> Limits:
    """Return the limits, rounded up to steps of the lattice."""
    unit_deg_s, limits = speed_unit(lattice, problem.step_s), problem.limits
    return Limits(
        unit_deg_s * math.ceil(limits.speed_deg_s / unit_deg_s - ROUNDING),
        unit_deg_s * math.ceil(limits.acceleration_deg_s2 * problem.step_s / unit_deg_s - ROUNDING) / problem.step_s,
    )


def _rests_per_turn(sample_count: int) -> Iterator[int]:
    """Yield the possible numbers of rest angles per turn, ascending: a fraction of the samples, all, or a multiple."""
    yield from (count for count in range(1, sample_count) if sample_count % count == 0)
    yield from (sample_count * multiple for multiple in range(1, 10_000))
