"""Chapter 5: the replies."""

from decimal import ROUND_HALF_EVEN, Decimal

from protocol.conformance.bench.stand import ERROR_REPLIES, PRESET, STRICT
from protocol.conformance.cases.case import case
from protocol.conformance.judgement.rig import Rig
from protocol.conformance.judgement.verdict import InapplicableError, NonconformityError, require
from protocol.conformance.judgement.wire_checks import number
from protocol.messages import ErrorCode

_KINDS = (b"H ", b"L ", b"OK", b"OK", b"H ", b"OK", b"L ", b"H ", b"ERR 3 ", b"ERR 1 ")
"""The first bytes of the replies to the ten lines of `_mixed`."""


@case("5.1/1", ERROR_REPLIES)
def each_line_has_one_reply(rig: Rig) -> None:
    """Send ten lines of every kind, one by one. Each has one reply, and nothing follows it."""
    for line in _mixed(rig):
        rig.ask(line)
    rig.silence("after ten replies the line")


@case("5.1/2", ERROR_REPLIES)
def replies_come_in_order(rig: Rig) -> None:
    """Send ten lines of every kind at once, three times. The replies have the right kinds and the right order."""
    lines = _mixed(rig)
    for _ in range(3):
        rig.wire.send(b"\r".join(lines) + b"\r")
        for line, kind in zip(lines, _KINDS, strict=True):
            got = rig.reply_to(line).text
            require(got.startswith(kind), f"of ten lines sent at once, {line!r} got {got!r}, not {kind.decode()}...")


@case("5.1/2:motion", travel_deg=20)
def replies_come_in_order_in_motion(rig: Rig) -> None:
    """During a motion, send readings of both registers at once, three times. The position only increases."""
    rig.settings(rig.profile.motion.speed_deg_s / 2, rig.profile.motion.acceleration_deg_s2)
    rig.move_to(20)
    rig.follow(0.2)
    last = Decimal(-(10**9))
    for _ in range(3):
        rig.wire.send(b"H\rL\rH\rL\rH\r")
        for letter in (b"H", b"L", b"H", b"L", b"H"):
            angle = rig.angle_in(rig.reply_to(letter), letter)
            if letter == b"H":
                require(angle >= last, f"the position fell from {last} to {angle} deg in a forward motion")
                last = angle
    rig.finish()


@case("5.1/3", travel_deg=10)
def nothing_else_is_sent(rig: Rig) -> None:
    """Move without reading: the line stays silent, at the end of the motion too."""
    rig.move_to(10)
    duration_s = rig.motion.expectations[-1].motion.duration_s
    heard = rig.wire.listen(duration_s + 0.3)
    require(not heard, f"the table sent {heard!r} on its own")
    rig.finish()


@case("5.1/4")
def a_reply_ends_in_cr_alone(rig: Rig) -> None:
    """Look for LF, and for a space before the CR."""
    speed, rate = _settings(rig)
    for line in (b"H", b"L", speed, b"?" if rig.profile.serial.error_replies else rate):
        got = rig.ask(line).text
        require(got == got.strip() and b"\n" not in got, f"{line!r} got {got!r}: white space around a reply")


@case("5.2/1")
def an_angle_has_its_form(rig: Rig) -> None:
    """Read both registers; the form of the reply is checked byte by byte."""
    rig.read(b"H")
    rig.read(b"L")


@case("5.2/1:negative", travel_deg=5)
def a_negative_angle_has_its_form(rig: Rig) -> None:
    """Read positions on both sides of home."""
    for target in (-5, 5):
        rig.move_to(target)
        rig.finish(f"at {target}")


@case("5.2/2")
def an_angle_has_its_decimals(rig: Rig) -> None:
    """Count the decimals of both registers."""
    for letter in (b"H", b"L"):
        got = rig.ask(letter).text
        decimals = len(got.partition(b".")[2])
        require(decimals == rig.profile.serial.decimals, f"{letter!r} got {got!r}: {decimals} decimals")


@case("5.2/3", PRESET)
def an_angle_is_rounded(rig: Rig) -> None:
    """Preset the counter to values whose angles must be rounded up and down, of both signs."""
    count_deg = rig.profile.table.counts_per_deg
    for share in (0.3, 0.49, 0.51, 0.9, 7.26, 123.74):
        for sign in (1, -1):
            _expect_rounded(rig, round(sign * share * rig.profile.resolution_deg * count_deg))


@case("5.2/4", PRESET)
def halves_go_to_the_even_digit(rig: Rig) -> None:
    """Preset the counter to angles exactly between two readings."""
    unit = Decimal(1).scaleb(-rig.profile.serial.decimals)
    count_deg = Decimal(repr(rig.profile.table.counts_per_deg))
    # The fifth of these is 0.25 deg on the default table, which must be reported as 0.2.
    halves = [(2 * k + 1) * unit / 2 * count_deg for k in range(200)]
    exact = [int(half) for half in halves if half == int(half)][:4]
    if not exact:
        raise InapplicableError("this counter has no count whose angle lies between two readings")
    for count in exact:
        _expect_rounded(rig, count)
        _expect_rounded(rig, -count)


@case("5.2/5", PRESET)
def zero_has_no_sign(rig: Rig) -> None:
    """Preset the counter to values just below 0 that round to 0."""
    half = rig.profile.resolution_deg / 2 * rig.profile.table.counts_per_deg
    for count in {-1, -int(half * 0.5), -int(half * 0.9), 0}:
        _expect_rounded(rig, count)


@case("5.2/5:motion", travel_deg=2)
def zero_has_no_sign_after_a_motion(rig: Rig) -> None:
    """Approach 0 from both sides, if the start position is 0. Readings during the motion count too."""
    if rig.home_deg != 0:
        raise InapplicableError(f"the session began at {rig.home_deg} deg, not at 0")
    for target in (-0.02, 0.0, -1.0, 0.0, 0.02, -0.03):
        rig.move_to(target)
        rig.finish(f"at {target}")


@case("5.2/6")
def an_angle_has_nothing_needless(rig: Rig) -> None:
    """Look for leading zeros, a plus sign and further spaces."""
    for letter in (b"H", b"L"):
        got = rig.ask(letter).text
        digits = got[2:].removeprefix(b"-").partition(b".")[0]
        good = got[1:2] == b" " and digits.isdigit() and (digits == b"0" or not digits.startswith(b"0"))
        require(good, f"{letter!r} got {got!r}")


@case("5.3/1", ERROR_REPLIES)
def unknown_command_is_1(rig: Rig) -> None:
    """Require the text of the error too."""
    _expect_words(rig, b"?", ErrorCode.UNKNOWN_COMMAND)


@case("5.3/2", ERROR_REPLIES)
def bad_number_is_2(rig: Rig) -> None:
    """Require the text of the error too."""
    _expect_words(rig, b"R x", ErrorCode.BAD_NUMBER)


@case("5.3/3", ERROR_REPLIES)
def out_of_range_is_3(rig: Rig) -> None:
    """Require the text of the error too."""
    _expect_words(rig, b"S 0", ErrorCode.OUT_OF_RANGE)


@case("5.3/4", ERROR_REPLIES)
def line_too_long_is_4(rig: Rig) -> None:
    """Require the text of the error too."""
    _expect_words(rig, b" " * 33, ErrorCode.LINE_TOO_LONG)


@case("5.3/5", ERROR_REPLIES)
def bad_byte_is_5(rig: Rig) -> None:
    """Require the text of the error too."""
    _expect_words(rig, b"\xff", ErrorCode.BAD_BYTE)


@case("5.4/1", STRICT)
def a_strict_table_refuses_in_silence(rig: Rig) -> None:
    """Send one line of each fault."""
    for line in (b"?", b"R x", b"S 0", b" " * 33, b"\xff"):
        rig.wire.send(line + b"\r")
        rig.silence(f"refused {line!r}")


@case("5.4/2", STRICT)
def a_strict_table_answers_all_else(rig: Rig) -> None:
    """Mix refused lines with others. The others have their replies in order."""
    speed, _ = _settings(rig)
    rig.wire.send(b"H\r?\r%s\rS 0\rL\rR x\rR 0\r" % speed)
    for line, kind in ((b"H", b"H "), (speed, b"OK"), (b"L", b"L "), (b"R 0", b"OK")):
        got = rig.reply_to(line).text
        if not got.startswith(kind):
            raise NonconformityError(f"{line!r} got {got!r}, not {kind.decode()}...")
    rig.silence("after the last of them the line")


def _settings(rig: Rig) -> tuple[bytes, bytes]:
    """Return lines that set S and A to the values that the profile allows."""
    allowed = rig.profile.motion
    return b"S " + number(allowed.speed_deg_s), b"A " + number(allowed.acceleration_deg_s2)


def _mixed(rig: Rig) -> tuple[bytes, ...]:
    """Return ten lines, each with its own kind of reply. With their CR they fit the minimum buffer."""
    return (b"H", b"L", *_settings(rig), b"H", b"R 0", b"L", b"H", b"S 0", b"?")


def _expect_words(rig: Rig, line: bytes, code: ErrorCode) -> None:
    rig.expect(line, b"ERR %d %s" % (code, code.text.encode()))


def _expect_rounded(rig: Rig, count: int) -> None:
    """Preset the counter, and with it the latch. Require readings that are rounded to the even digit."""
    rig.stand.preset(count)
    angle = Decimal(count) / Decimal(repr(rig.profile.table.counts_per_deg))
    wanted = angle.quantize(Decimal(1).scaleb(-rig.profile.serial.decimals), ROUND_HALF_EVEN)
    for letter in (b"H", b"L"):
        got = rig.read(letter)
        said = f"a count of {count}, {angle:.6f} deg, is read with {letter!r} as {got}, not {wanted + 0}"
        require(got == wanted, said)
