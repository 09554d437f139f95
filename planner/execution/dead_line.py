"""What happens when the line dies in mid-run: nobody can stop the table, and it runs on to its last P.

The arm stops where it is. Between two scan locations it may stand at either, so the way of the table has to be free at
both. This is judged at many moments of a run, from the commands that were sent.
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
"""From one moment to the next."""


class DeadLine(NamedTuple):
    """What would have happened if the line had died.

    Attributes:
        longest_deg: how far the table would have run on at most.
        moments: at how many moments this was asked.
        forbidden_moments: at how many of them it would have met a forbidden region.
        first_s: the first of these, in the time of the motion; None where there is none.
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
    """Return what would have happened if the line had died at any moment of a run.

    Args:
        configuration_map: where the table may be with the arm at a location.
        motion: what the table should do.
        record: what was sent to the table and seen of it.
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
    """Return when a run ended: with its motion, or when the table was stopped."""
    if record.failure is None:
        return motion.end_s
    last_sent_s = record.sent[-1].time_s if record.sent else motion.start_s
    last_seen_s = record.observations[-1].time_s if record.observations else motion.start_s
    return min(max(last_sent_s, last_seen_s), motion.end_s)


def _arm_at(leg: Leg) -> tuple[int, ...]:
    """Return the scan locations at which the arm may stand in a leg; none while the probe is drawn back."""
    if leg.phase is Phase.SCAN:
        return leg.column, leg.column + 1
    if leg.phase is Phase.ROTATE:
        return ()
    return (leg.column + 1,) if leg.phase is Phase.APPROACH else (leg.column,)


def _ways_to_rest(
    motion: TableMotion, sent: Sequence[Sent], until_s: float
) -> Iterator[tuple[float, float, float, float]]:
    """Yield moments, and for each the lowest angle, the present one and the highest, until the table stands."""
    ends_s = [*(_effect_s(after) for after in sent[1:]), until_s]
    state = ReferenceState(motion.start_deg, 0.0)
    for each, end_s in zip(sent, ends_s, strict=False):  # nothing was sent: no moments
        begin_s = _effect_s(each)
        for k in range(int(np.ceil(begin_s / MOMENT_S)), int(np.ceil(end_s / MOMENT_S))):
            there = advance(state, each.command, k * MOMENT_S - begin_s)
            lowest_deg, highest_deg = way_to_rest_deg(there, each.command)
            yield k * MOMENT_S, lowest_deg, there.angle_deg, highest_deg
        state = advance(state, each.command, max(0.0, end_s - begin_s))


def _effect_s(sent: Sent) -> float:
    """Return when a command took effect."""
    return sent.time_s + max(0.0, sent.late_s)
