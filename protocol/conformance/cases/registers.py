"""Chapter 6: the registers and the latch."""

from protocol.conformance.case import case
from protocol.conformance.rig import Rig
from protocol.conformance.stand import POWER_CYCLE, PRESET, TRIGGER
from protocol.conformance.verdict import require
from protocol.conformance.wire_checks import number


@case("6.1/1", TRIGGER, travel_deg=10)
def position_and_latch_are_two_registers(rig: Rig) -> None:
    """Latch, then move: the position follows the motion, the latch does not."""
    rig.stand.trigger()
    latched = rig.read(b"L")
    rig.move_to(10)
    rig.finish()
    later = rig.read(b"L")
    require(later == latched, f"the latch went from {latched} to {later} deg without a trigger")


@case("6.1/2", PRESET, travel_deg=5)
def a_position_is_exact_at_both_ends(rig: Rig) -> None:
    """Preset the counter near each of its ends, and move to a position nearer still."""
    last = rig.profile.range_deg
    for begin, target in ((last - 5, last - 1.7), (5 - last, 1.7 - last)):
        rig.stand.preset(round(begin * rig.profile.table.counts_per_deg))
        rig.full_settings()
        rig.expect(b"P " + number(target))
        rig.wait_for_rest()
        rig.measure(f"from {target:.1f}", float(rig.read()) - target, "deg", *rig.near(0))


@case("6.1/3", PRESET, travel_deg=10)
def a_register_runs_over_its_end(rig: Rig) -> None:
    """Preset the counter just below its end, move over it and back: the motion is as anywhere else."""
    top = rig.profile.range_deg
    rig.stand.preset(2**31 - round(5 * rig.profile.table.counts_per_deg))
    rig.settings(rig.profile.motion.speed_deg_s / 2, rig.profile.motion.acceleration_deg_s2 / 2)
    rig.stand_at(top - 5)
    allowed = rig.profile.tolerance.rest_deg + rig.profile.resolution_deg
    for way, expected in ((10, -top + 5), (-10, top - 5)):
        rig.move_by(way)
        rig.follow()
        rig.wait_for_rest()
        error = float(rig.read()) - expected
        rig.measure(f"after R {way}, from {expected:.1f}", error, "deg", -allowed, allowed)
    rig.motion.samples[:] = [one._replace(position_deg=one.position_deg % (2 * top)) for one in rig.motion.samples]
    rig.check_tracking("over the end and back")


@case("6.1/4", travel_deg=200)
def the_table_turns_both_ways(rig: Rig) -> None:
    """Move by more than half a turn forwards, and by more than half a turn backwards."""
    rig.settings(rig.profile.motion.speed_deg_s, rig.profile.motion.acceleration_deg_s2)
    for target in (200, 0):
        rig.move_to(target)
        rig.finish(f"to {target}")


@case("6.1/5", POWER_CYCLE, travel_deg=5)
def registers_are_0_at_power_on(rig: Rig) -> None:
    """Move, latch where the rig can, switch the table off and on, and read both registers."""
    rig.move_to(5)
    rig.finish()
    if TRIGGER in rig.stand.capabilities:
        rig.stand.trigger()
    rig.power_cycle()
    for letter in (b"H", b"L"):
        angle = rig.read(letter)
        require(angle == 0, f"{letter!r} is {angle} at power-on")


@case("6.2/1", TRIGGER, travel_deg=40)
def a_trigger_latches_the_position(rig: Rig) -> None:
    """At constant speed, there and back, trigger between two readings: the latch lies between them."""
    speed = rig.profile.motion.speed_deg_s / 2
    rig.settings(speed, rig.profile.motion.acceleration_deg_s2)
    worst_deg = 0.0
    for target in (40, 0):
        rig.move_to(target)
        rig.follow(speed / rig.rate_deg_s2 + 0.1)
        for _ in range(8):
            before = rig.sample().position_deg
            rig.stand.trigger()
            after = rig.sample().position_deg
            latched = float(rig.read(b"L"))
            worst_deg = max(worst_deg, min(before, after) - latched, latched - max(before, after))
        rig.finish(f"to {target}")
    rig.measure("latch outside of the readings around it", worst_deg, "deg", most=rig.profile.resolution_deg)


@case("6.2/2", TRIGGER, travel_deg=20)
def each_trigger_overwrites_the_latch(rig: Rig) -> None:
    """Latch at three places, with two triggers before each is read."""
    for target in (10, 20, 0):
        rig.stand.trigger()
        rig.move_to(target)
        rig.finish(f"at {target}")
        rig.stand.trigger()
        error = float(rig.read(b"L") - rig.read())
        rig.measure(
            f"latch at {target}, from the position",
            error,
            "deg",
            -rig.profile.resolution_deg,
            rig.profile.resolution_deg,
        )


@case("6.2/2:power-on", POWER_CYCLE, travel_deg=10)
def the_latch_holds_the_position_at_power_on(rig: Rig) -> None:
    """Switch the table off and on, move, and read the latch without a trigger."""
    rig.power_cycle()
    rig.stand_at_home()
    rig.settings(rig.profile.motion.speed_deg_s, rig.profile.motion.acceleration_deg_s2)
    rig.move_to(10)
    rig.finish()
    require(rig.read(b"L") == 0, "the latch is not 0 before the first trigger")


@case("6.2/3", TRIGGER, travel_deg=20)
def a_trigger_disturbs_nothing(rig: Rig) -> None:
    """Trigger again and again in a motion, in the midst of replies too."""
    rig.settings(rig.profile.motion.speed_deg_s / 2, rig.profile.motion.acceleration_deg_s2 / 2)
    rig.move_to(20)
    for _ in range(20):
        rig.wire.send(b"H\r")
        rig.stand.trigger()
        rig.angle_in(rig.reply_to(b"H"))
        rig.sample()
    rig.finish()
