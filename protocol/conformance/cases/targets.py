"""Chapters 4.4 and 4.5: `P` and `R` give the table a target."""

from protocol.conformance.case import case
from protocol.conformance.rig import Rig
from protocol.conformance.stand import PRESET
from protocol.conformance.verdict import require
from protocol.conformance.wire_checks import number
from protocol.messages import ErrorCode

_OUT_OF_RANGE = ErrorCode.OUT_OF_RANGE


@case("4.4/1", travel_deg=370)
def p_never_takes_the_short_way(rig: Rig) -> None:
    """Turn by one turn and 10 degrees, backwards."""
    rig.settings(rig.profile.motion.speed_deg_s, rig.profile.motion.acceleration_deg_s2)
    rig.move_to(-370)
    rig.finish()


@case("4.4/2")
def a_position_beyond_the_counter_is_refused(rig: Rig) -> None:
    """Command positions just beyond both ends of the counter's range."""
    with rig.unmoved(b"a position beyond the counter"):
        for target in (rig.profile.range_deg + 0.001, 2 * rig.profile.range_deg, -rig.profile.range_deg - 0.1):
            rig.refused(b"P " + number(target), _OUT_OF_RANGE)


@case("4.4/3", PRESET)
def a_motion_beyond_half_the_counter_is_refused(rig: Rig) -> None:
    """Preset the counter far up, and command a position far down: the counter has both, but the way is too long."""
    far_deg = 0.75 * rig.profile.range_deg
    rig.stand.preset(round(far_deg * rig.profile.table.counts_per_deg))
    with rig.unmoved(b"a motion beyond half the counter"):
        rig.refused(b"P " + number(-far_deg), _OUT_OF_RANGE)


@case("4.4/4", travel_deg=10)
def ok_is_not_arrival(rig: Rig) -> None:
    """`OK` comes before the table is there."""
    rig.set_speed(min(rig.profile.motion.speed_deg_s, 10 / (10 * rig.reading_s)))  # ten readings fit the way
    rig.move_to(10)
    require(rig.sample().position_deg - rig.home_deg < 5, "the table was there with its OK")
    rig.finish()


@case("4.5/1", travel_deg=30)
def an_increment_in_motion_is_from_the_present_reference(rig: Rig) -> None:
    """During a motion, move by an increment: it counts from where the table is, not from where it was going."""
    rig.settings(rig.profile.motion.speed_deg_s / 2, rig.profile.motion.acceleration_deg_s2 / 2)
    rig.move_to(30)
    rig.follow(0.5)
    rig.move_by(10)
    rig.finish()


@case("4.5/2", travel_deg=4)
def increments_add_up(rig: Rig) -> None:
    """Move by a small increment ten times, waiting for rest in between."""
    for _ in range(10):
        rig.move_by(0.3333)
        rig.follow()
        rig.wait_for_rest()
    rig.finish("ten increments")


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
        for way in (rig.profile.range_deg + 0.1, -rig.profile.range_deg - 0.1):
            rig.refused(b"R " + number(way), _OUT_OF_RANGE)
