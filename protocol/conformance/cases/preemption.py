"""Chapter 7.3: a motion that replaces another."""

from protocol.conformance.cases.case import case
from protocol.conformance.judgement.rig import Rig


@case("7.3/1", travel_deg=30)
def a_new_target_replaces_the_old(rig: Rig) -> None:
    """On the way to 30, command a much nearer position, then 30 again."""
    _under_way(rig, 30)
    rig.move_to(10)
    rig.follow(0.5)
    rig.move_to(30)
    rig.finish()


@case("7.3/2", travel_deg=40)
def the_speed_does_not_step(rig: Rig) -> None:
    """At full speed, command a farther position with another A: the speed continues."""
    _under_way(rig, 25)
    rig.set_acceleration(rig.rate_deg_s2 / 4)
    rig.move_to(40)
    rig.finish()


@case("7.3/2:accelerating", travel_deg=40)
def the_speed_does_not_step_while_it_grows(rig: Rig) -> None:
    """During acceleration, command a slightly farther position, fifteen times.

    Speed and position continue each time.
    """
    top = rig.profile.motion.speed_deg_s
    rig.settings(top, min(rig.profile.motion.acceleration_deg_s2 / 2, top / (20 * rig.reading_s)))
    rig.move_to(30)
    for further in range(15):
        rig.move_to(30 + further / 2)
        rig.sample()
    rig.finish()


@case("7.3/3:behind", travel_deg=30)
def a_target_behind(rig: Rig) -> None:
    """At speed, command the start position."""
    _under_way(rig, 30)
    rig.move_to(0)
    rig.finish()


@case("7.3/3:near", travel_deg=30)
def a_target_nearer_than_the_braking_distance(rig: Rig) -> None:
    """At speed, command a position just ahead: the table overshoots and returns."""
    rate = _under_way(rig, 30)
    position, speed = rig.reference_at(rig.wire.clock.now_s())
    rig.move_to(round(position - rig.home_deg + 0.3 * speed**2 / (2 * rate), 1))
    rig.finish()


@case("7.3/3:reversal", travel_deg=20)
def reversals(rig: Rig) -> None:
    """Command a reversal twice before the first motion ends."""
    _under_way(rig, 20)
    rig.move_to(-10)
    rig.follow(1.2)
    rig.move_to(10)
    rig.finish()


@case("7.3/4", travel_deg=30)
def a_lower_speed(rig: Rig) -> None:
    """At speed, command half of that speed: the table decelerates at A."""
    _under_way(rig, 30)
    rig.set_speed(rig.top_deg_s / 2)
    rig.move_to(30)
    rig.finish()


@case("7.3/4:higher", travel_deg=30)
def a_higher_speed(rig: Rig) -> None:
    """At speed, command twice that speed: the table accelerates at A."""
    _under_way(rig, 30)
    rig.set_speed(rig.top_deg_s * 2)
    rig.move_to(30)
    rig.finish()


@case("7.3/5", travel_deg=30)
def a_higher_acceleration(rig: Rig) -> None:
    """During acceleration, command a higher A."""
    _under_way(rig, 30)
    rig.set_acceleration(rig.rate_deg_s2 * 2)
    rig.move_to(30)
    rig.finish()


@case("7.3/5:lower", travel_deg=40)
def a_lower_acceleration(rig: Rig) -> None:
    """Near the target, command an A that is too low for a stop in time: the table overshoots and returns."""
    _under_way(rig, 15)
    rig.set_acceleration(rig.rate_deg_s2 / 5)
    rig.move_to(15)
    rig.finish()


@case("7.3/6", travel_deg=20)
def the_same_target_again(rig: Rig) -> None:
    """Send the same `P` ten times during the motion."""
    _under_way(rig, 20)
    for _ in range(10):
        rig.expect(b"P %d" % (rig.home_deg + 20))
        rig.sample()
    rig.finish()


@case("7.3/7", travel_deg=30)
def the_last_of_a_burst_decides(rig: Rig) -> None:
    """Send eight random targets one after the other without a pause, then a ninth."""
    _under_way(rig, 10)
    for _ in range(8):
        rig.move_to(rig.chance.randrange(-10, 20))
    rig.move_to(5)
    rig.finish()


@case("7.3/3:stop", travel_deg=30)
def r_0_brakes_and_returns(rig: Rig) -> None:
    """Send `R 0` at speed."""
    _under_way(rig, 30)
    rig.move_by(0)
    rig.finish()


def _under_way(rig: Rig, target_deg: float) -> float:
    """Start a motion, follow it until it is at speed, and return its acceleration."""
    rate = rig.profile.motion.acceleration_deg_s2 / 2
    rig.settings(rig.profile.motion.speed_deg_s / 2, rate)
    rig.move_to(target_deg)
    rig.follow(rig.top_deg_s / rate + 0.1)
    return rate
