"""Chapters 4.2 and 4.3: `H` and `L` read the position and the latch."""

from protocol.conformance.bench.stand import TRIGGER
from protocol.conformance.cases.case import case
from protocol.conformance.judgement.rig import Rig, cruising_speed
from protocol.conformance.judgement.verdict import require


@case("4.2/1", travel_deg=10)
def h_reads_the_position(rig: Rig) -> None:
    """Move, and read the position."""
    rig.move_to(10)
    rig.finish()


@case("4.2/2", travel_deg=40)
def a_position_is_of_the_time_of_its_reply(rig: Rig) -> None:
    """Read repeatedly at constant speed: each step of the position fits the time between its readings."""
    allowed = rig.profile.motion
    speed = min(allowed.speed_deg_s / 2, 40 / (20 * rig.reading_s), cruising_speed(40, allowed.acceleration_deg_s2))
    rig.settings(speed, allowed.acceleration_deg_s2)
    rig.move_to(40)
    begin_s = speed / rig.rate_deg_s2 + 0.1
    rig.follow(begin_s)
    began_s, duration_s = rig.motion.expectations[-1].began_s, rig.motion.expectations[-1].motion.duration_s
    rig.follow(duration_s - 2 * begin_s)
    # A register that is updated only sometimes gives the same position twice, then a jump.
    steps = zip(rig.motion.samples, rig.motion.samples[1:], strict=False)
    slowing_s = duration_s - speed / rig.rate_deg_s2
    cruising = [(one, two) for one, two in steps if begin_s < one.time_s - began_s and two.time_s - began_s < slowing_s]
    worst_deg = max(
        abs(two.position_deg - one.position_deg - speed * (two.time_s - one.time_s))
        - speed * (one.uncertainty_s + two.uncertainty_s)
        for one, two in cruising
    )
    allowed_deg = rig.profile.step_deg + 0.1 * speed * 0.1
    rig.measure("step of the position minus speed times time", max(worst_deg, 0.0), "deg", most=allowed_deg)
    rig.finish()


@case("4.2/3", travel_deg=370)
def the_position_is_unwrapped(rig: Rig) -> None:
    """Turn by one turn and 10 degrees, then back."""
    rig.settings(rig.profile.motion.speed_deg_s, rig.profile.motion.acceleration_deg_s2)
    for target in (370, 0):
        rig.move_to(target)
        rig.finish(f"at {target}")


@case("4.2/4", travel_deg=10)
def reading_changes_nothing(rig: Rig) -> None:
    """Read both registers repeatedly, in a motion and at rest: reading does not change motion or latch."""
    latched = rig.read(b"L")
    rig.move_to(10)
    for _ in range(10):
        rig.sample()
        rig.read(b"L")
    rig.finish()
    resting = rig.read()
    for letter, value in ((b"H", resting), (b"L", latched)) * 10:
        got = rig.read(letter)
        require(got == value, f"{letter!r} went from {value} to {got} deg although both were only read")


@case("4.3/1")
def l_reads_the_latch(rig: Rig) -> None:
    """Read the latch."""
    rig.read(b"L")


@case("4.3/2", TRIGGER, travel_deg=10)
def reading_keeps_the_latch(rig: Rig) -> None:
    """Latch a position, move on, and read the latch twice."""
    rig.move_to(10)
    rig.finish()
    rig.stand.trigger()
    rig.move_to(0)
    rig.finish()
    latched = [rig.read(b"L") for _ in range(3)]
    require(len(set(latched)) == 1, f"the latch was read as {latched}")
    rig.measure("latch", float(latched[0]) - rig.home_deg, "deg", *rig.near(10))
