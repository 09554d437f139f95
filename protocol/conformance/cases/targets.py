"""Chapters 4.4 and 4.5: `P` and `R` give the table a target."""

from math import ceil, floor, sqrt

from protocol.conformance.bench.stand import PRESET
from protocol.conformance.cases.case import case
from protocol.conformance.judgement.rig import Rig
from protocol.conformance.judgement.verdict import require
from protocol.conformance.judgement.wire_checks import number
from protocol.messages import ErrorCode

_LITTLE_DEG = 0.00049
"""Becomes 0 when it is rounded to thousandths, or to counts of an encoder with fewer than 1000 counts per degree."""
_LITTLE_S = 30.0
"""Maximum time for sending these increments."""
_PAUSE_S = 0.1
_MARGIN_S = 0.002
"""Ticks of a controller by which a small motion may take longer."""

_OUT_OF_RANGE = ErrorCode.OUT_OF_RANGE


@case("4.4/1", travel_deg=190)
def p_never_takes_the_short_way(rig: Rig) -> None:
    """Turn backward by more than half a turn. Case 4.2/3 turns by more than a whole turn in both directions."""
    rig.settings(rig.profile.motion.speed_deg_s, rig.profile.motion.acceleration_deg_s2)
    rig.move_to(-190)
    rig.finish()


@case("4.4/2")
def a_position_beyond_the_counter_is_refused(rig: Rig) -> None:
    """Command positions just beyond both ends of the counter's range."""
    with rig.unmoved(b"a position beyond the counter"):
        range_deg = rig.profile.range_deg
        for target in (range_deg + 0.001, 2 * range_deg, 2 * range_deg + 5, -range_deg - 0.1, -2 * range_deg - 5):
            rig.refused(b"P " + number(target), _OUT_OF_RANGE)


@case("4.4/3", PRESET)
def a_motion_beyond_half_the_counter_is_refused(rig: Rig) -> None:
    """Preset the counter to a high value, and command a low position.

    The counter can hold both, but the travel is too long.
    """
    far_deg = 0.75 * rig.profile.range_deg
    rig.stand.preset(round(far_deg * rig.profile.table.counts_per_deg))
    with rig.unmoved(b"a motion beyond half the counter"):
        rig.refused(b"P " + number(-far_deg), _OUT_OF_RANGE)


@case("4.4/3:half", PRESET, travel_deg=2)
def a_motion_of_half_the_counter_is_accepted(rig: Rig) -> None:
    """From 0, move to the lower end of the counter, which is half its range away, and stop.

    From 1 deg above 0, the same command is refused.
    """
    lowest = b"P -" + _within_range(rig)
    rig.stand.preset(0)
    rig.stand_afresh_at(0)
    rig.begin_far_motion(lowest)
    rig.stand.preset(ceil(1.1 * rig.profile.table.counts_per_deg))
    with rig.unmoved(b"a motion just beyond half the counter"):
        rig.refused(lowest, _OUT_OF_RANGE)


@case("4.4/4", travel_deg=10)
def ok_is_not_arrival(rig: Rig) -> None:
    """`OK` is received before the table is at its target."""
    rig.set_speed(min(rig.profile.motion.speed_deg_s, 10 / (10 * rig.reading_s)))  # ten readings fit the motion
    rig.move_to(10)
    require(rig.sample().position_deg - rig.home_deg < 5, "the table had arrived when it sent OK")
    rig.finish()


@case("4.5/1", travel_deg=30)
def an_increment_in_motion_is_from_the_present_reference(rig: Rig) -> None:
    """Move by an increment during a motion: it counts from the present position, not from the target."""
    rig.settings(rig.profile.motion.speed_deg_s / 2, rig.profile.motion.acceleration_deg_s2 / 2)
    rig.move_to(30)
    rig.follow(0.5)
    rig.move_by(10)
    rig.finish()


@case("4.5/2", travel_deg=4)
def increments_add_up(rig: Rig) -> None:
    """Move by a third of a degree ten times, each time to the end.

    Then move many times by less than half a thousandth.
    """
    for _ in range(10):
        rig.move_by(0.3333)
        rig.follow()
        rig.wire.clock.sleep_s(_PAUSE_S)
    rig.finish("ten increments")
    start_deg, count = 10 * 0.3333 + rig.home_deg, _little_increments(rig)
    line = b"R%.5f" % _LITTLE_DEG
    motion_s = 2 * sqrt(_LITTLE_DEG / rig.rate_deg_s2) + _MARGIN_S
    for _ in range(count):
        rig.expect(line)
        rig.wire.clock.sleep_s(max(0.0, motion_s - len(line) * rig.profile.byte_s))  # the next line takes time too
    moved_deg = float(rig.wait_for_rest()) - start_deg
    rig.measure(f"{count} times {_LITTLE_DEG:f}", moved_deg, "deg", *rig.near(count * _LITTLE_DEG))


@case("4.5/3", travel_deg=30)
def r_0_comes_back_to_where_it_was_received(rig: Rig) -> None:
    """During a motion send `R 0`."""
    rig.settings(rig.profile.motion.speed_deg_s / 2, rig.profile.motion.acceleration_deg_s2 / 4)
    rig.move_to(30)
    rig.follow(0.6)
    rig.move_by(0)
    rig.finish()


@case("4.5/4")
def r_0_at_rest_moves_nothing(rig: Rig) -> None:
    """At rest send `R 0`, three times."""
    with rig.unmoved(b"R 0"):
        for _ in range(3):
            rig.expect(b"R 0")
            rig.wire.clock.sleep_s(0.05)


@case("4.5/5")
def an_increment_beyond_half_the_counter_is_refused(rig: Rig) -> None:
    """Command increments just beyond half the counter's range."""
    with rig.unmoved(b"an increment beyond half the counter"):
        for way in (rig.profile.range_deg + 0.1, -rig.profile.range_deg - 0.1, 2 * rig.profile.range_deg + 5):
            rig.refused(b"R " + number(way), _OUT_OF_RANGE)


@case("4.5/5:half", PRESET, travel_deg=2)
def an_increment_of_half_the_counter_is_accepted(rig: Rig) -> None:
    """Move by half the counter's range in both directions, and stop."""
    for sign in (b"-", b""):
        rig.stand.preset(0)
        rig.stand_afresh_at(0)
        rig.begin_far_motion(b"R " + sign + _within_range(rig))


def _within_range(rig: Rig) -> bytes:
    """Return the largest whole number within half the counter's range. On the default table it is exactly that half."""
    return b"%d" % floor(rig.profile.range_deg)


def _little_increments(rig: Rig) -> int:
    """Return how many small increments show the loss of one, as far as a slow line has the time."""
    least, most = rig.near(0)
    return min(ceil((most - least) / _LITTLE_DEG), int(_LITTLE_S / rig.reading_s))
