"""The consequences of a line that fails during a run: nobody can stop the table, and it continues to its last P.

The arm stops where it is. Between two scan locations it may be at either one, so the table's path must be clear at
both. The sent commands determine this at many times of a run.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from planner.execution.clear_path import is_clear
from planner.execution.run_record import Record, Sent
from planner.execution.table_motion import Leg, Phase, TableMotion
from planner.map.config_map import ConfigurationMap
from protocol.trapezoid import ReferenceState, advance, way_to_rest_deg

MOMENT_S = 0.02
"""Time from one check to the next."""


class DeadLine(NamedTuple):
    """The consequences if the line had failed.

    Attributes:
        longest_deg: maximum angle that the table would have run on.
        moments: number of checks.
        forbidden_moments: number of checks with a forbidden region on the path.
        first_s: the first of these, in the time of the motion; None if there are none.
        first_location: the scan location that the arm had reached then.
    """

    longest_deg: float
    moments: int
    forbidden_moments: int
    first_s: float | None
    first_location: int | None

    def __str__(self) -> str:
        text = f"the table would run on by up to {self.longest_deg:.0f} deg, and"
        if self.first_s is None:
            return f"{text} cross a forbidden region at none of {self.moments} moments"
        return (
            f"{text} cross a forbidden region at {self.forbidden_moments} of {self.moments} moments;"
            f" the first is at {self.first_s:.2f} s, location {self.first_location}"
        )


def judge_dead_line(configuration_map: ConfigurationMap, motion: TableMotion, record: Record) -> DeadLine:
    """Return the consequences of a line that fails at any time of a run.

    Args:
        configuration_map: the angles at which the table may be with the arm at a location.
        motion: the planned motion of the table.
        record: the sent commands and the readings.
    """
    longest_deg, moments = 0.0, 0
    forbidden: list[tuple[float, int]] = []
    for time_s, lowest_deg, at_deg, highest_deg in _ways_to_rest(motion, record.sent, _end_s(motion, record)):
        moments += 1
        longest_deg = max(longest_deg, highest_deg - at_deg, at_deg - lowest_deg)
        leg = motion.leg_at(time_s)
        if not all(is_clear(configuration_map, location, lowest_deg, highest_deg) for location in _arm_at(leg)):
            forbidden.append((time_s, leg.column))
    first_s, first_location = forbidden[0] if forbidden else (None, None)
    return DeadLine(longest_deg, moments, len(forbidden), first_s, first_location)


def _end_s(motion: TableMotion, record: Record) -> float:
    """Return the end of a run: the end of its motion, or the time at which the table was stopped."""
    if record.failure is None:
        return motion.end_s
    last_sent_s = record.sent[-1].time_s if record.sent else motion.start_s
    last_seen_s = record.observations[-1].time_s if record.observations else motion.start_s
    return min(max(last_sent_s, last_seen_s), motion.end_s)


def _arm_at(leg: Leg) -> tuple[int, ...]:
    """Return the scan locations at which the arm may be in a leg; none while the probe is retracted."""
    if leg.phase is Phase.SCAN:
        return leg.column, leg.column + 1
    if leg.phase is Phase.ROTATE:
        return ()
    return (leg.column + 1,) if leg.phase is Phase.APPROACH else (leg.column,)


def _ways_to_rest(
    motion: TableMotion, sent: Sequence[Sent], until_s: float
) -> Iterator[tuple[float, float, float, float]]:
    """Yield times, and for each one the minimum, present and maximum angle until the table stands."""
    ends_s = [*(_effect_s(after) for after in sent[1:]), until_s]
    state = ReferenceState(motion.start_deg, 0.0)
    for each, end_s in zip(sent, ends_s, strict=False):  # nothing was sent: no checks
        begin_s = _effect_s(each)
        for k in range(int(np.ceil(begin_s / MOMENT_S)), int(np.ceil(end_s / MOMENT_S))):
            there = advance(state, each.command, k * MOMENT_S - begin_s)
            lowest_deg, highest_deg = way_to_rest_deg(there, each.command)
            yield k * MOMENT_S, lowest_deg, there.angle_deg, highest_deg
        state = advance(state, each.command, max(0.0, end_s - begin_s))


def _effect_s(sent: Sent) -> float:
    """Return when a command took effect."""
    return sent.time_s + max(0.0, sent.late_s)
