"""Chapter 4: the grammar and the six commands."""

from protocol.conformance.case import case
from protocol.conformance.rig import Rig, number, require
from protocol.conformance.stand import POWER_CYCLE, TRIGGER
from protocol.messages import ErrorCode

_BAD_NUMBER = ErrorCode.BAD_NUMBER
_OUT_OF_RANGE = ErrorCode.OUT_OF_RANGE


@case("4.1/1")
def a_letter_begins_a_line(rig: Rig) -> None:
    """Send lines that begin otherwise."""
    for line in (b"h", b" H", b"?", b"Q", b"5", b"p 10", b"-", b"OK", b"~"):
        rig.refused(line, ErrorCode.UNKNOWN_COMMAND)


@case("4.1/2")
def spaces_are_free(rig: Rig) -> None:
    """Put spaces, or none, where they may stand."""
    speed = number(rig.profile.motion.speed_deg_s)
    for line in (b"S" + speed, b"S   " + speed, b"S " + speed + b"   "):
        rig.expect(line)
    rig.angle_in(rig.ask(b"H   "))


@case("4.1/3")
def a_reading_takes_no_number(rig: Rig) -> None:
    """Send `H` and `L` with something behind."""
    for line in (b"H 1", b"H0", b"HH", b"L x", b"L ."):
        rig.refused(line, _BAD_NUMBER)


@case("4.1/4")
def a_setting_takes_exactly_one_number(rig: Rig) -> None:
    """Send settings with no number, with two, and with words."""
    with rig.unmoved(b"a setting without its number"):
        for line in (b"P", b"R ", b"S", b"A  ", b"P 1 2", b"R 0 0", b"S ten", b"A 1 0"):
            rig.refused(line, _BAD_NUMBER)


@case("4.1/5", travel_deg=2)
def a_number_may_have_a_sign(rig: Rig) -> None:
    """Send `+` and `-` with increments that add up to nothing, and `-0`."""
    rig.expect(b"R +2")
    rig.wait_for_rest()
    rig.measure("after R +2", float(rig.read()) - rig.home_deg, "deg", *_near(rig, 2))
    rig.expect(b"R -2")
    rig.wait_for_rest()
    rig.expect(b"R -0")
    rig.measure("after R -2 and R -0", float(rig.read()) - rig.home_deg, "deg", *_near(rig, 0))


@case("4.1/6")
def a_point_has_digits_on_both_sides(rig: Rig) -> None:
    """Send numbers that begin or end with the point."""
    with rig.unmoved(b"a number with half a point"):
        for line in (b"P 5.", b"R .5", b"S 5.", b"A .5", b"R .", b"R -.5", b"R 1..5", b"R 1.2.3"):
            rig.refused(line, _BAD_NUMBER)


@case("4.1/7")
def a_number_is_plain(rig: Rig) -> None:
    """Send signs too many, exponents, names and separators."""
    with rig.unmoved(b"a number that is none"):
        for text in (b"--5", b"+-5", b"5-", b"1e4", b"1e400", b"1E1", b"nan", b"inf", b"-inf", b"1,5", b"1_0", b"0x10"):
            rig.refused(b"R " + text, _BAD_NUMBER)


@case("4.1/8", travel_deg=2)
def all_decimals_count(rig: Rig) -> None:
    """Move by an increment whose decimals are beyond the first, several times: they add up."""
    for _ in range(4):
        rig.expect(b"R 0.2499999999999999999999999")
        rig.wait_for_rest()
    rig.measure("4 times 0.25", float(rig.read()) - rig.home_deg, "deg", *_near(rig, 1))


@case("4.1/9")
def an_unusable_number_is_out_of_range(rig: Rig) -> None:
    """Send numbers of good form that no table can use."""
    with rig.unmoved(b"a number out of range"):
        for line in (b"P 99999999999999", b"P -99999999999999", b"R 9999999999999999999999999999", b"S 99999999999"):
            rig.refused(line, _OUT_OF_RANGE)


@case("4.1/10", travel_deg=30)
def a_refused_line_changes_nothing(rig: Rig) -> None:
    """During a motion send refused lines of every kind; it ends as it began, and so does the next one."""
    rig.settings(rig.profile.motion.speed_deg_s / 2, rig.profile.motion.acceleration_deg_s2 / 2)
    rig.move_to(15)
    rig.follow(0.1)
    for line, code in (
        (b"P 99999999999999", _OUT_OF_RANGE),
        (b"R x", _BAD_NUMBER),
        (b"S 0", _OUT_OF_RANGE),
        (b"A 0", _OUT_OF_RANGE),
        (b"P 0 0", _BAD_NUMBER),
        (b"R 0\x18", ErrorCode.BAD_BYTE),
        (b"p 0", ErrorCode.UNKNOWN_COMMAND),
        (b"R 0".ljust(40), ErrorCode.LINE_TOO_LONG),
    ):
        rig.refused(line, code)
    rig.finish("with refused lines in it")
    rig.move_to(30)
    rig.finish("after them")


@case("4.1/11", travel_deg=30)
def every_command_is_accepted_in_motion(rig: Rig) -> None:
    """During a motion send each of the six commands."""
    speed, rate = rig.profile.motion.speed_deg_s / 4, rig.profile.motion.acceleration_deg_s2 / 4
    rig.settings(speed, rate)
    rig.move_to(15)
    rig.follow(0.3)
    rig.read(b"H")
    rig.read(b"L")
    rig.settings(2 * speed, 2 * rate)
    rig.move_to(10)
    rig.follow(0.1)
    rig.move_by(5)
    rig.finish()


@case("4.2/1", travel_deg=10)
def h_reads_the_position(rig: Rig) -> None:
    """Move, and read where the table is."""
    rig.move_to(10)
    rig.finish()


@case("4.2/2", travel_deg=40)
def a_position_is_of_the_time_of_its_reply(rig: Rig) -> None:
    """At constant speed, fit a line through the positions and the times at which they can have been true."""
    speed = rig.profile.motion.speed_deg_s / 2
    rig.settings(speed, rig.profile.motion.acceleration_deg_s2)
    rig.move_to(40)
    begin_s = speed / rig.rate_deg_s2 + 0.1
    rig.follow(begin_s)
    rig.follow(rig.motion.expectations[-1].motion.duration_s - 2 * begin_s)
    # A register that is read only now and then gives the same position twice, then a jump.
    steps = zip(rig.motion.samples, rig.motion.samples[1:], strict=False)
    cruising = [(one, two) for one, two in steps if begin_s < one.time_s - rig.motion.expectations[-1].began_s]
    worst_deg = max(
        abs(two.position_deg - one.position_deg - speed * (two.time_s - one.time_s))
        - speed * (one.uncertainty_s + two.uncertainty_s)
        for one, two in cruising
    )
    allowed_deg = rig.profile.resolution_deg + 0.1 * speed * 0.1
    rig.measure("step of the position, beyond its time", max(worst_deg, 0.0), "deg", most=allowed_deg)
    rig.finish()


@case("4.2/3", travel_deg=370)
def the_position_is_unwrapped(rig: Rig) -> None:
    """Turn by one turn and 10 degrees."""
    rig.settings(rig.profile.motion.speed_deg_s, rig.profile.motion.acceleration_deg_s2)
    rig.move_to(370)
    rig.finish()


@case("4.2/4")
def reading_changes_nothing(rig: Rig) -> None:
    """Read ten times."""
    first = rig.read()
    for _ in range(10):
        require(rig.read() == first, "the position changed while it was only read")


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
    rig.measure("latch", float(latched[0]) - rig.home_deg, "deg", *_near(rig, 10))


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
        for target in (rig.profile.range_deg, 2 * rig.profile.range_deg, -rig.profile.range_deg - 0.1):
            rig.refused(b"P " + number(target), _OUT_OF_RANGE)


@case("4.4/4", travel_deg=10)
def ok_is_not_arrival(rig: Rig) -> None:
    """`OK` comes before the table is there."""
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
        for way in (rig.profile.range_deg, -rig.profile.range_deg - 0.1):
            rig.refused(b"R " + number(way), _OUT_OF_RANGE)


@case("4.6/1", travel_deg=30)
def s_holds_for_the_motions_after_it(rig: Rig) -> None:
    """Set S once; two motions keep it."""
    rig.settings(rig.profile.motion.speed_deg_s / 2, rig.profile.motion.acceleration_deg_s2)
    for target in (15, 30):
        rig.move_to(target)
        rig.finish(f"to {target}")


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
    """Set S to 0, below 0 and above the limit; the limit itself is accepted."""
    limit = rig.profile.limits.speed_deg_s
    for text in (b"0", b"-0", b"0.0", b"-1", number(limit + 0.1), number(limit + 1000)):
        rig.refused(b"S " + text, _OUT_OF_RANGE)
    rig.expect(b"S " + number(limit))


@case("4.6/4")
def a_speed_that_rounds_to_nothing_is_refused(rig: Rig) -> None:
    """Set S to a number of 25 decimals."""
    rig.refused(b"S 0.0000000000000000000000001", _OUT_OF_RANGE)


@case("4.6/5", POWER_CYCLE, travel_deg=20)
def the_speed_at_power_on(rig: Rig) -> None:
    """Switch the table off and on, set A alone, and move."""
    rig.stand.power_cycle()
    rig.home_deg = 0
    rig.stand_at_home()
    rig.set_acceleration(rig.profile.motion.acceleration_deg_s2)
    rig.top_deg_s = rig.profile.power_on.speed_deg_s
    rig.move_to(20)
    rig.finish()


@case("4.7/1", travel_deg=20)
def a_holds_for_the_motions_after_it(rig: Rig) -> None:
    """Set A once; two motions keep it, both ways."""
    rig.settings(rig.profile.motion.speed_deg_s, rig.profile.motion.acceleration_deg_s2 / 4)
    for target in (20, 0):
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
    """Set A to 0, below 0 and above the limit; the limit itself is accepted."""
    limit = rig.profile.limits.acceleration_deg_s2
    for text in (b"0", b"-0", b"0.0", b"-1", number(limit + 0.1), number(limit + 1000)):
        rig.refused(b"A " + text, _OUT_OF_RANGE)
    rig.expect(b"A " + number(limit))


@case("4.7/4")
def an_acceleration_that_rounds_to_nothing_is_refused(rig: Rig) -> None:
    """Set A to a number of 25 decimals."""
    rig.refused(b"A 0.0000000000000000000000001", _OUT_OF_RANGE)


@case("4.7/5", POWER_CYCLE, travel_deg=20)
def the_acceleration_at_power_on(rig: Rig) -> None:
    """Switch the table off and on, set S alone, and move."""
    rig.stand.power_cycle()
    rig.home_deg = 0
    rig.stand_at_home()
    rig.set_speed(rig.profile.motion.speed_deg_s)
    rig.rate_deg_s2 = rig.profile.power_on.acceleration_deg_s2
    rig.move_to(20)
    rig.finish()


def _near(rig: Rig, target_deg: float) -> tuple[float, float]:
    """Return the range in which a table that rests at a target may say that it stands."""
    allowed = rig.profile.tolerance.rest_deg + rig.profile.resolution_deg / 2
    return target_deg - allowed, target_deg + allowed
