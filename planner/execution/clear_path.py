"""Paths of the table at one scan location: find those that are clear and those that reach the start."""

from planner.errors import PlannerError
from planner.execution.table_motion import Phase, TableMotion
from planner.map.config_map import ConfigurationMap, sample_at_or_above, sample_at_or_below
from protocol.trapezoid import way_to_rest_deg

_TURN_DEG = 360.0


class BlockedPathError(PlannerError):
    """A path of the table through a forbidden region."""


def is_clear(configuration_map: ConfigurationMap, location: int, lowest_deg: float, highest_deg: float) -> bool:
    """Return whether the table may turn from one angle to another while the probe stays at a location."""
    count = configuration_map.angle_count
    first = sample_at_or_below(lowest_deg / configuration_map.angle_step_deg)
    last = sample_at_or_above(highest_deg / configuration_map.angle_step_deg)
    samples = range(first, min(last, first + count) + 1)
    return bool(configuration_map.allowed[location, [sample % count for sample in samples]].all())


def nearest_turns(position_deg: float, start_deg: float) -> int:
    """Return the number of full turns to add to a plan so that its start is nearest."""
    return round((position_deg - start_deg) / _TURN_DEG)


def turns_to_start(configuration_map: ConfigurationMap, position_deg: float, start_deg: float) -> int:
    """Return the number of full turns to add to a plan so that the shortest clear path reaches its start.

    Angles do not wrap in the protocol: after two turns, the table is at 720 degrees and stays there.

    Raises:
        BlockedPathError: no path is clear at the first location.
    """
    nearest = nearest_turns(position_deg, start_deg)
    other = nearest + (1 if start_deg + nearest * _TURN_DEG < position_deg else -1)
    for turns in (nearest, other):
        there_deg = start_deg + turns * _TURN_DEG
        if is_clear(configuration_map, 0, min(position_deg, there_deg), max(position_deg, there_deg)):
            return turns
    raise BlockedPathError(
        f"the table stands at {position_deg:.1f} deg and the plan starts at {start_deg:.1f}; with the arm at the first"
        " location both paths to the start cross a forbidden region; retract the arm, and add --arm-away"
    )


def check_ends(configuration_map: ConfigurationMap, motion: TableMotion) -> None:
    """Refuse a motion whose run-up or stop passes through a forbidden region.

    Raises:
        BlockedPathError: with the path and the location.
    """
    for leg in (motion.legs[0], motion.legs[-1]):
        if leg.phase is Phase.RUN_UP:
            ends = leg.start.angle_deg, leg.state_at(leg.end_s).angle_deg
            lowest_deg, highest_deg = min(ends), max(ends)
        elif leg.command is not None and leg.phase is Phase.STOP:
            lowest_deg, highest_deg = way_to_rest_deg(leg.start, leg.command)
        else:
            continue
        if not is_clear(configuration_map, leg.column, lowest_deg, highest_deg):
            raise BlockedPathError(
                f"the {leg.phase} at location {leg.column} takes the table from {lowest_deg:.1f} to"
                f" {highest_deg:.1f} deg, through a forbidden region; plan a motion that starts and ends more slowly,"
                " or farther from the region"
            )
