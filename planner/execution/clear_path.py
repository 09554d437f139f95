"""Paths of the table at one scan location: which are clear, and by which the start can be reached."""

from planner.errors import PlannerError
from planner.execution.table_motion import Phase, TableMotion
from planner.map.config_map import ConfigurationMap, sample_at_or_above, sample_at_or_below
from protocol.trapezoid import way_to_rest_deg

_TURN_DEG = 360.0


class BlockedPathError(PlannerError):
    """A path of the table that leads through a forbidden region."""


def is_clear(configuration_map: ConfigurationMap, location: int, lowest_deg: float, highest_deg: float) -> bool:
    """Tell whether the table may turn from one angle to another while the probe stays at a location."""
    count = configuration_map.angle_count
    first = sample_at_or_below(lowest_deg / configuration_map.angle_step_deg)
    last = sample_at_or_above(highest_deg / configuration_map.angle_step_deg)
    samples = range(first, min(last, first + count) + 1)
    return bool(configuration_map.allowed[location, [sample % count for sample in samples]].all())


def nearest_turns(position_deg: float, start_deg: float) -> int:
    """Return the full turns to add to a plan so that its start is nearest."""
    return round((position_deg - start_deg) / _TURN_DEG)


def turns_to_start(configuration_map: ConfigurationMap, position_deg: float, start_deg: float) -> int:
    """Return the full turns to add to a plan so that its start is reached by the shortest clear path.

    Angles do not wrap on the wire: a table that has made two turns stands at 720 degrees and stays there.

    Raises:
        BlockedPathError: neither path around is clear at the first location.
    """
    nearest = nearest_turns(position_deg, start_deg)
    other = nearest + (1 if start_deg + nearest * _TURN_DEG < position_deg else -1)
    for turns in (nearest, other):
        there_deg = start_deg + turns * _TURN_DEG
        if is_clear(configuration_map, 0, min(position_deg, there_deg), max(position_deg, there_deg)):
            return turns
    raise BlockedPathError(
        f"the table stands at {position_deg:.1f} deg and the plan starts at {start_deg:.1f}; with the arm at the first"
        " location both ways there lead through a forbidden region: draw the arm back, and say so with --arm-away"
    )


def check_ends(configuration_map: ConfigurationMap, motion: TableMotion) -> None:
    """Refuse a motion whose run-up, or whose stop, leads through a forbidden region.

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
                f" {highest_deg:.1f} deg, through a forbidden region: plan so that the motion begins and ends slowly,"
                " or farther from it"
            )
