"""Chapter 4.1: the grammar of a command."""

from decimal import Decimal

from protocol.conformance.bench.stand import PRESET
from protocol.conformance.cases.case import case
from protocol.conformance.judgement.rig import Rig
from protocol.conformance.judgement.wire_checks import number
from protocol.messages import LINE_LIMIT, ErrorCode, Verb

_LETTERS = {verb.encode() for verb in Verb}
_PRINTABLE = [bytes((byte,)) for byte in range(0x21, 0x7F)]
_WRAPS = (
    *(2**bits for bits in (8, 15, 16, 23, 24, 31, 32, 48, 53, 63, 64, 80)),
    *(10**n for n in (3, 5, 9, 12, 20, 25)),
)
"""Numbers of digits at which registers and buffers may end."""

_LOW = Decimal("0.15")
"""An S or an A that is a third lower when it is cut to one decimal place."""
_SLOW_S, _RAMP_S = 4.7, 3.3
"""The time in which this S, or A, makes a difference of a quarter of a degree."""

_BAD_NUMBER = ErrorCode.BAD_NUMBER
_OUT_OF_RANGE = ErrorCode.OUT_OF_RANGE


@case("4.1/1")
def a_letter_begins_a_line(rig: Rig) -> None:
    """Send every other printable byte alone, each letter with a number, and words."""
    others = [byte for byte in _PRINTABLE if byte not in _LETTERS]
    numbered = [byte + b" 1" for byte in others if byte.isalpha()]
    words = [word for word in (b" H", b"p 10", b"OK", b"ERR 1", b"VER", b"*IDN?", b"$H") if word[:1] not in _LETTERS]
    for line in (*others, *numbered, *words):
        rig.refused(line, ErrorCode.UNKNOWN_COMMAND)


@case("4.1/2")
def spaces_are_free(rig: Rig) -> None:
    """Put spaces, or none, at all allowed places."""
    speed, rate = number(rig.profile.motion.speed_deg_s), number(rig.profile.motion.acceleration_deg_s2)
    for line in (b"S" + speed, b"A" + rate, b"R0", b"R-0", b"S   " + speed, b"S " + speed + b"   "):
        rig.expect(line)
    rig.angle_in(rig.ask(b"H   "))


@case("4.1/3")
def a_reading_takes_no_number(rig: Rig) -> None:
    """Send `H` and `L` with text after the letter."""
    for line in (b"H 1", b"H0", b"HH", b"HOME", b"HELP", b"L x", b"L .", b"L0", b"LATCH"):
        rig.refused(line, _BAD_NUMBER)


@case("4.1/4")
def a_setting_takes_exactly_one_number(rig: Rig) -> None:
    """Send settings with no number, with two, and with words."""
    with rig.unmoved(b"a setting without its number"):
        for line in (b"P", b"R ", b"S", b"A  ", b"P 1 2", b"R 0 0", b"S ten", b"A 1 0", b"RESET", b"STOP", b"STATUS"):
            rig.refused(line, _BAD_NUMBER)


@case("4.1/5", travel_deg=2)
def a_number_may_have_a_sign(rig: Rig) -> None:
    """Send `+` and `-` with all settings.

    The sign applies to values between -1 and 1, and to whole part and decimals alike.
    """
    for letter, limit in ((b"S ", rig.profile.motion.speed_deg_s), (b"A ", rig.profile.motion.acceleration_deg_s2)):
        rig.expect(letter + b"+" + number(limit))
        rig.refused(letter + b"-0.25", _OUT_OF_RANGE)
    steps = [(b"R +2", 2.0), (b"R -2", 0.0), (b"R -0", 0.0), (b"R -0.5", -0.5), (b"R -1.5", -2.0), (b"R +1.5", -0.5)]
    if rig.home_deg == 0:  # on other tables these targets are far away
        steps += [(b"P -1.5", -1.5), (b"P -0.5", -0.5), (b"P +0.5", 0.5), (b"P -0", 0.0)]
    for line, expected_deg in steps:
        rig.expect(line)
        at_deg = float(rig.wait_for_rest()) - rig.home_deg
        rig.measure(f"after {line.decode()}", at_deg, "deg", *rig.near(expected_deg))


@case("4.1/6")
def a_point_has_digits_on_both_sides(rig: Rig) -> None:
    """Send numbers that start or end with the decimal point."""
    with rig.unmoved(b"a number with half a point"):
        for line in (b"P 5.", b"R .5", b"S 5.", b"A .5", b"R .", b"R -.5", b"R 1..5", b"R 1.2.3"):
            rig.refused(line, _BAD_NUMBER)


@case("4.1/7")
def a_number_is_plain(rig: Rig) -> None:
    """Send numbers with too many signs, exponents, names and separators."""
    with rig.unmoved(b"a number that is none"):
        for text in (b"--5", b"+-5", b"5-", b"1e1", b"1e400", b"1E1", b"nan", b"inf", b"-inf", b"1,5", b"1_0", b"0x10"):
            rig.refused(b"R " + text, _BAD_NUMBER)


@case("4.1/8", travel_deg=2)
def all_decimals_count(rig: Rig) -> None:
    """Move by increments and to positions with 2 to 25 irregular decimals. Add leading zeros to a number."""
    rig.expect(b"S " + number(rig.profile.motion.speed_deg_s).rjust(LINE_LIMIT - 2, b"0"))
    sign = 1
    for places in (2, 3, 4, 5, 8, 9, 10, 11, 12, 16, 17, 19, 20, 25):
        rig.move_by_text(_irregular(Decimal(sign), places))
        rig.follow()
        rig.move_to_text(_irregular(rig.home_deg + Decimal(sign) / 2, min(places, LINE_LIMIT - 10)))
        rig.follow()
        sign = -sign
    rig.finish("with many decimals")


@case("4.1/8:settings", travel_deg=3)
def all_decimals_of_s_and_a_count(rig: Rig) -> None:
    """Start motions with an S, then with an A, that is much lower when a decimal is cut or a register overflows."""
    rig.set_speed_text(_irregular(_LOW, 25))
    rig.move_by(3)
    rig.follow(_SLOW_S)
    rig.full_settings()
    rig.move_to(0)
    rig.finish("S with 25 decimals")
    rig.set_acceleration_text(_irregular(_LOW, 11))
    rig.move_by(3)
    rig.follow(_RAMP_S)
    rig.full_settings()
    rig.move_to(0)
    rig.finish("A with 11 decimals")


@case("4.1/8:whole", PRESET, travel_deg=2)
def all_digits_of_the_whole_part_count(rig: Rig) -> None:
    """Start increments of 2^17 and -2^16 deg. Stop beyond the remainder that a register leaves when it wraps."""
    for whole in (2**17, -(2**16)):
        rig.stand.preset(0)
        rig.stand_afresh_at(0)
        rig.begin_far_motion(b"R %d.01" % whole)


@case("4.1/9")
def an_unusable_number_is_out_of_range(rig: Rig) -> None:
    """Send well-formed numbers that no table can use.

    Some of them wrap in a register of 8 to 80 bits.
    """
    limits, range_deg = rig.profile.limits, rig.profile.range_deg
    with rig.unmoved(b"a number out of range"):
        for line in (b"P 99999999999999", b"P -99999999999999", b"R 9999999999999999999999999999", b"S 99999999999"):
            rig.refused(line, _OUT_OF_RANGE)
        for value in sorted(sign * wrap + 5 for wrap in (*_WRAPS, round(2 * range_deg)) for sign in (1, -1)):
            for letter, refused in (
                (b"P", abs(value) > range_deg + 1),
                (b"R", abs(value) > range_deg + 1),
                (b"S", not 0 < value <= limits.speed_deg_s),
                (b"A", not 0 < value <= limits.acceleration_deg_s2),
            ):
                if refused:
                    rig.refused(b"%s %d" % (letter, value), _OUT_OF_RANGE)


@case("4.1/10", travel_deg=30)
def a_refused_line_changes_nothing(rig: Rig) -> None:
    """Send refused lines of every kind during a motion. This motion and the next one end as commanded."""
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
    """Send each of the six commands during a motion."""
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


def _irregular(value: Decimal, places: int) -> bytes:
    """Return a number near a value, with decimals that have no pattern."""
    return f"{value - Decimal(2).sqrt() / 1000 - Decimal(1) / 2**20:.{places}f}".encode()
