"""Chapters 4.6 and 4.7: `S` and `A` set the maximum speed and the acceleration."""

from protocol.conformance.bench.stand import DISCONNECT, POWER_CYCLE
from protocol.conformance.cases.case import case
from protocol.conformance.judgement.rig import Rig
from protocol.conformance.judgement.wire_checks import number
from protocol.messages import ErrorCode

_OUT_OF_RANGE = ErrorCode.OUT_OF_RANGE


@case("4.6/1", travel_deg=20)
def s_holds_for_the_motions_after_it(rig: Rig) -> None:
    """Set S once, with a decimal. A motion with `P` and one with `R` use it."""
    rig.settings(rig.profile.motion.speed_deg_s * 5 / 16, rig.profile.motion.acceleration_deg_s2)
    rig.move_to(10)
    rig.finish("with P")
    rig.move_by(10)
    rig.finish("with R")


@case("4.6/1:reconnect", DISCONNECT, travel_deg=20)
def s_and_a_outlive_a_client(rig: Rig) -> None:
    """Close and open the port during a motion. The motion continues, and the next one uses the same S and A."""
    rig.settings(rig.profile.motion.speed_deg_s / 2, rig.profile.motion.acceleration_deg_s2 / 2)
    rig.move_to(20)
    rig.follow(0.3)
    rig.wire.reopen()
    rig.finish("after a new client connected")
    rig.move_to(0)
    rig.finish("the next motion")


@case("4.6/2", travel_deg=30)
def s_leaves_the_running_motion_alone(rig: Rig) -> None:
    """Set S during a motion: higher, then lower."""
    rig.settings(rig.profile.motion.speed_deg_s / 2, rig.profile.motion.acceleration_deg_s2)
    for target, share in ((30, 1.0), (0, 0.25)):
        rig.set_speed(rig.profile.motion.speed_deg_s / 2)
        rig.move_to(target)
        rig.follow(0.4)
        rig.set_speed(rig.profile.motion.speed_deg_s * share)
        rig.finish(f"S {number(rig.top_deg_s).decode()} set in it")


@case("4.6/3")
def an_impossible_speed_is_refused(rig: Rig) -> None:
    """Set S to 0, below 0 and above the limit. The limit itself is accepted."""
    limit = rig.profile.limits.speed_deg_s
    for text in (b"0", b"-0", b"0.0", b"-0.5", b"-1", number(limit + 0.1), number(limit + 1000)):
        rig.refused(b"S " + text, _OUT_OF_RANGE)
    rig.expect(b"S " + number(limit))


@case("4.6/4")
def a_speed_that_rounds_to_nothing_is_refused(rig: Rig) -> None:
    """Set S to a number of 25 decimals."""
    rig.refused(b"S 0.0000000000000000000000001", _OUT_OF_RANGE)


@case("4.6/5", POWER_CYCLE, travel_deg=20)
def the_speed_at_power_on(rig: Rig) -> None:
    """Switch the table off and on, set A alone, and move."""
    rig.power_cycle()
    rig.stand_at_home()
    rig.set_acceleration(rig.profile.motion.acceleration_deg_s2)
    rig.top_deg_s = rig.profile.power_on.speed_deg_s
    rig.move_to(20)
    rig.finish()


@case("4.7/1", travel_deg=15)
def a_holds_for_the_motions_after_it(rig: Rig) -> None:
    """Set A once, with a decimal. Two motions use it, in both directions."""
    rig.settings(rig.profile.motion.speed_deg_s, rig.profile.motion.acceleration_deg_s2 / 8)
    for target in (15, 0):
        rig.move_to(target)
        rig.finish(f"to {target}")


@case("4.7/2", travel_deg=20)
def a_leaves_the_running_motion_alone(rig: Rig) -> None:
    """Set A during a motion: higher, then lower."""
    rate = rig.profile.motion.acceleration_deg_s2
    for target, share in ((20, 1.0), (0, 0.1)):
        rig.settings(rig.profile.motion.speed_deg_s / 2, rate / 4)
        rig.move_to(target)
        rig.follow(0.3)
        rig.set_acceleration(rate * share)
        rig.finish(f"A {number(rig.rate_deg_s2).decode()} set in it")


@case("4.7/3")
def an_impossible_acceleration_is_refused(rig: Rig) -> None:
    """Set A to 0, below 0 and above the limit. The limit itself is accepted."""
    limit = rig.profile.limits.acceleration_deg_s2
    for text in (b"0", b"-0", b"0.0", b"-0.5", b"-1", number(limit + 0.1), number(limit + 1000)):
        rig.refused(b"A " + text, _OUT_OF_RANGE)
    rig.expect(b"A " + number(limit))


@case("4.7/4")
def an_acceleration_that_rounds_to_nothing_is_refused(rig: Rig) -> None:
    """Set A to a number of 25 decimals."""
    rig.refused(b"A 0.0000000000000000000000001", _OUT_OF_RANGE)


@case("4.7/5", POWER_CYCLE, travel_deg=20)
def the_acceleration_at_power_on(rig: Rig) -> None:
    """Switch the table off and on, set S alone, and move."""
    rig.power_cycle()
    rig.stand_at_home()
    rig.set_speed(rig.profile.motion.speed_deg_s)
    rig.rate_deg_s2 = rig.profile.power_on.acceleration_deg_s2
    rig.move_to(20)
    rig.finish()
