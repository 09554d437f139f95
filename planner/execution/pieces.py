"""The pieces of a motion with one command each: its legs, and parts of legs that are too long for one command.

A long, fast step with low acceleration has two problems. The table would run on far if the line fails (`run_on`). It
would also deviate too much from the plan between two locations.
"""

import math
from collections.abc import Iterator

from planner.execution.run_on import latest_s, least_rate
from planner.execution.table_motion import Leg, TableMotion
from planner.table.motion import Limits
from planner.table.wire import Wire, exchanges_s
from protocol.trapezoid import MotionCommand

# Maximum deviation of the reference between two commands because A is larger than in the plan.
_DEVIATION_DEG = 0.1
# No shorter pieces: the line and the readings of the encoder need their time.
_SHORTEST_S = 0.1
_SHORTEST_EXCHANGES = 2.5
# No longer pieces: S and A have a limited resolution, and the resulting error grows with time.
_LONGEST_S = 1.5
# The reference may be some tenths ahead of its leg, because start and targets are rounded to the resolution of the
# protocol.
_ROUNDED_DEG = 0.25


def spacing_s(farthest_deg: float, limits: Limits, wire: Wire) -> float:
    """Return the transmission time of the longest commands of a motion, including all readings between them."""
    farthest_deg = abs(farthest_deg) + 1000.0
    return 1.25 * exchanges_s(wire, MotionCommand(-farthest_deg, *limits)) + 0.01


def pieces_of(motion: TableMotion, limits: Limits, wire: Wire, run_on_deg: float) -> tuple[Leg, ...]:
    """Return the legs of a motion, divided if one command for the whole leg is not sufficient."""
    spacing = spacing_s(farthest_deg(motion), limits, wire)
    return tuple(piece for leg in motion.legs for piece in pieces_of_leg(leg, limits, spacing, run_on_deg))


def farthest_deg(motion: TableMotion) -> float:
    """Return the maximum distance from angle 0 of the start of a leg of a motion."""
    return max(abs(leg.start.angle_deg) for leg in motion.legs)


def pieces_of_leg(leg: Leg, limits: Limits, spacing: float, run_on_deg: float) -> Iterator[Leg]:
    """Yield a leg, or its parts, for commands that need a spacing in s between them."""
    shortest_s = max(_SHORTEST_S, _SHORTEST_EXCHANGES * spacing)
    most = max(1, math.floor(leg.duration_s / shortest_s))
    is_enough = _follows if leg.command is None else _is_short
    count = next((n for n in range(1, most) if is_enough(leg, n, limits, run_on_deg)), most)
    if count == 1:
        yield leg
        return
    part_s = leg.duration_s / count
    for k in range(count):
        start_s = leg.start_s + k * part_s
        part = leg._replace(start_s=start_s, duration_s=part_s, start=leg.state_at(start_s))
        yield part if leg.command is None else part._replace(command=_nearer(leg, part))


def _follows(leg: Leg, count: int, limits: Limits, run_on_deg: float) -> bool:
    """Return whether pieces of a leg can be followed accurately and with a short run-on.

    Let a piece have the acceleration a and the duration T, and the ramp A in its middle. Then the deviation from the
    plan is a T^2 / 8 (1 - a / A).
    """
    part_s = leg.duration_s / count
    speed_deg_s = max(abs(leg.start.speed_deg_s), abs(leg.state_at(leg.end_s).speed_deg_s))
    rate = least_rate(speed_deg_s, part_s, run_on_deg)
    planned = abs(leg.acceleration_deg_s2)
    deviation_deg = 0.125 * planned * part_s**2 * max(0.0, 1.0 - planned / rate) if rate > 0.0 else 0.0
    return part_s <= _LONGEST_S and rate <= limits.acceleration_deg_s2 and deviation_deg <= _DEVIATION_DEG


def _is_short(leg: Leg, count: int, limits: Limits, run_on_deg: float) -> bool:
    """Return whether a motion to rest can be divided anywhere with a short run-on, by nearer targets."""
    assert leg.command is not None
    if abs(leg.command.target_deg - leg.start.angle_deg) <= run_on_deg:
        return True
    rate = least_rate(leg.command.speed_deg_s, leg.duration_s / count, run_on_deg)
    return rate <= limits.acceleration_deg_s2


def _nearer(leg: Leg, part: Leg) -> MotionCommand:
    """Return the command of a leg with the nearest target for which the table does not brake within a piece of it."""
    command = leg.command
    assert command is not None
    forward = math.copysign(1.0, command.target_deg - leg.start.angle_deg)
    late = leg.state_at(part.end_s + latest_s(part.duration_s))
    ahead_deg = 0.5 * late.speed_deg_s**2 / command.acceleration_deg_s2 + _ROUNDED_DEG
    target_deg = late.angle_deg + forward * ahead_deg
    if forward * target_deg >= forward * command.target_deg:
        return command
    return command._replace(target_deg=target_deg)
