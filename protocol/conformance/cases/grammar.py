"""Chapter 4.1: the grammar of a command."""

from protocol.conformance.case import case
from protocol.conformance.rig import Rig
from protocol.conformance.wire_checks import number
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
    speed, rate = number(rig.profile.motion.speed_deg_s), number(rig.profile.motion.acceleration_deg_s2)
    for line in (b"S" + speed, b"A" + rate, b"R0", b"R-0", b"S   " + speed, b"S " + speed + b"   "):
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
    """Send `+` and `-` with increments that add up to nothing, and `-0`; and `+` with the settings."""
    rig.expect(b"S +" + number(rig.profile.motion.speed_deg_s))
    rig.expect(b"A +" + number(rig.profile.motion.acceleration_deg_s2))
    rig.expect(b"R +2")
    rig.wait_for_rest()
    rig.measure("after R +2", float(rig.read()) - rig.home_deg, "deg", *rig.near(2))
    rig.expect(b"R -2")
    rig.wait_for_rest()
    rig.expect(b"R -0")
    rig.measure("after R -2 and R -0", float(rig.read()) - rig.home_deg, "deg", *rig.near(0))


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
        for text in (b"--5", b"+-5", b"5-", b"1e1", b"1e400", b"1E1", b"nan", b"inf", b"-inf", b"1,5", b"1_0", b"0x10"):
            rig.refused(b"R " + text, _BAD_NUMBER)


@case("4.1/8", travel_deg=2)
def all_decimals_count(rig: Rig) -> None:
    """Move by an increment whose decimals are beyond the first, several times: they add up."""
    for _ in range(4):
        rig.expect(b"R 0.2499999999999999999999999")
        rig.wait_for_rest()
    rig.measure("4 times 0.25", float(rig.read()) - rig.home_deg, "deg", *rig.near(1))


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
        (b"S 9999999", _OUT_OF_RANGE),
        (b"A 9999999", _OUT_OF_RANGE),
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
