"""Chapter 7.3: a motion that replaces another."""

from protocol.conformance.cases.case import case
from protocol.conformance.judgement.rig import Rig


@case("7.3/1", travel_deg=30)
def a_new_target_replaces_the_old(rig: Rig) -> None:
    """On the way to 30 be sent to a place much nearer, then on to 30 again."""
    _under_way(rig, 30)
    rig.move_to(10)
    rig.follow(0.5)
    rig.move_to(30)
    rig.finish()


@case("7.3/2", travel_deg=40)
def the_speed_does_not_step(rig: Rig) -> None:
    """At top speed be sent farther, with another A: the speed goes on."""
    _under_way(rig, 25)
    rig.set_acceleration(rig.rate_deg_s2 / 4)
    rig.move_to(40)
    rig.finish()


@case("7.3/2:accelerating", travel_deg=40)
def the_speed_does_not_step_while_it_grows(rig: Rig) -> None:
    """While the table accelerates be sent a little farther, fifteen times: each time speed and position go on."""
    top = rig.profile.motion.speed_deg_s
    rig.settings(top, min(rig.profile.motion.acceleration_deg_s2 / 2, top / (20 * rig.reading_s)))
    rig.move_to(30)
    for further in range(15):
        rig.move_to(30 + further / 2)
        rig.sample()
    rig.finish()


@case("7.3/3:behind", travel_deg=30)
def a_target_behind(rig: Rig) -> None:
    """At speed be sent back to the start."""
    _under_way(rig, 30)
    rig.move_to(0)
    rig.finish()


@case("7.3/3:near", travel_deg=30)
def a_target_nearer_than_the_braking_distance(rig: Rig) -> None:
    """At speed be sent to a place just ahead: overshoot, and come back."""
    rate = _under_way(rig, 30)
    position, speed = rig.reference_at(rig.wire.clock.now_s())
    rig.move_to(round(position - rig.home_deg + 0.3 * speed**2 / (2 * rate), 1))
    rig.finish()


@case("7.3/3:reversal", travel_deg=20)
def reversals(rig: Rig) -> None:
    """Be sent to and fro, twice before the first motion is over."""
    _under_way(rig, 20)
    rig.move_to(-10)
    rig.follow(1.2)
    rig.move_to(10)
    rig.finish()


@case("7.3/4", travel_deg=30)
def a_lower_speed(rig: Rig) -> None:
    """At speed be given half of it: the table decelerates at A."""
    _under_way(rig, 30)
    rig.set_speed(rig.top_deg_s / 2)
    rig.move_to(30)
    rig.finish()


@case("7.3/4:higher", travel_deg=30)
def a_higher_speed(rig: Rig) -> None:
    """At speed be given twice of it: the table accelerates at A."""
    _under_way(rig, 30)
    rig.set_speed(rig.top_deg_s * 2)
    rig.move_to(30)
    rig.finish()


@case("7.3/5", travel_deg=30)
def a_higher_acceleration(rig: Rig) -> None:
    """While accelerating be given a higher A."""
    _under_way(rig, 30)
    rig.set_acceleration(rig.rate_deg_s2 * 2)
    rig.move_to(30)
    rig.finish()


@case("7.3/5:lower", travel_deg=40)
def a_lower_acceleration(rig: Rig) -> None:
    """Near the target be given an A with which the table cannot stop in time: overshoot, and come back."""
    _under_way(rig, 15)
    rig.set_acceleration(rig.rate_deg_s2 / 5)
    rig.move_to(15)
    rig.finish()


@case("7.3/6", travel_deg=20)
def the_same_target_again(rig: Rig) -> None:
    """While the table moves, send the same `P` ten times."""
    _under_way(rig, 20)
    for _ in range(10):
        rig.expect(b"P %d" % (rig.home_deg + 20))
        rig.sample()
    rig.finish()


@case("7.3/7", travel_deg=30)
def the_last_of_a_burst_decides(rig: Rig) -> None:
    """Send eight targets one after the other without a pause, drawn by chance, then a ninth."""
    _under_way(rig, 10)
    for _ in range(8):
        rig.move_to(rig.chance.randrange(-10, 20))
    rig.move_to(5)
    rig.finish()


@case("7.3/3:stop", travel_deg=30)
def r_0_brakes_and_returns(rig: Rig) -> None:
    """At speed send `R 0`."""
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
