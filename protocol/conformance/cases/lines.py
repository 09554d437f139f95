"""Chapter 3: bytes and lines."""

from protocol.conformance.bench.stand import DISCONNECT, ERROR_REPLIES
from protocol.conformance.cases.case import case
from protocol.conformance.judgement.rig import Rig
from protocol.conformance.judgement.verdict import require
from protocol.conformance.judgement.wire_checks import number
from protocol.messages import LINE_LIMIT, ErrorCode

_PAUSE_S = 6.0
"""Longer than most timeouts after which a table might discard or execute an incomplete line."""


@case("3.1/1")
def a_line_ends_in_cr(rig: Rig) -> None:
    """Send `H`: no reply. Then send CR: the reply."""
    rig.wire.send(b"H")
    rig.silence("'H' without its CR")
    rig.wire.send(b"\r")
    rig.angle_in(rig.reply_to(b"H"))


@case("3.1/2")
def lf_is_ignored(rig: Rig) -> None:
    """Put LF before, within and after commands, and within a number.

    Without the LF, that number is a speed above the limit.
    """
    for line in (b"\nH", b"H\n", b"\n\nH\n\n"):
        rig.angle_in(rig.ask(line))
    rig.wire.send(b"H\r\nL\r\nH\n\r")
    for letter in (b"H", b"L", b"H"):
        rig.angle_in(rig.reply_to(letter), letter)
    rig.wire.send(b"\n")
    rig.silence("a lone LF")
    too_fast = b"%d" % (10 * rig.profile.limits.speed_deg_s + 10)
    rig.refused(b"S " + too_fast[:1] + b"\n" + too_fast[1:], ErrorCode.OUT_OF_RANGE)


@case("3.1/3")
def an_empty_line_has_no_reply(rig: Rig) -> None:
    """Send empty lines: without bytes, with spaces, with LF. Then `H` has one reply."""
    rig.wire.send(b"\r\r  \r\n\r \n \r")
    rig.silence("empty lines")
    rig.read()
    rig.silence("after the reply the line")


@case("3.1/4")
def bytes_may_come_slowly(rig: Rig) -> None:
    """Send a command byte by byte with pauses, two commands split within a line, and one command with a long pause."""
    line = b"S %s\r" % number(rig.profile.motion.speed_deg_s)
    for index in range(len(line)):
        rig.wire.send(line[index : index + 1])
        rig.wire.clock.sleep_s(0.02)
    got = rig.reply_to(line).text
    require(got == b"OK", f"{line!r}, byte by byte, got {got!r}, not b'OK'")
    rig.wire.send(b"H\rL")
    rig.angle_in(rig.reply_to(b"H"))
    rig.wire.send(b"\r")
    rig.angle_in(rig.reply_to(b"L"), b"L")
    rig.wire.send(line[:-2])
    heard = rig.wire.listen(_PAUSE_S)
    require(not heard, f"{line[:-2]!r} without CR for {_PAUSE_S:g} s, got {heard!r}")
    rig.wire.send(line[-2:])
    got = rig.reply_to(line).text
    require(got == b"OK", f"{line!r}, with a pause of {_PAUSE_S:g} s in it, got {got!r}, not b'OK'")


@case("3.1/5", DISCONNECT)
def a_half_line_goes_with_its_client(rig: Rig) -> None:
    """Send an incomplete command, close the port and open it again: the next line is read alone."""
    rig.wire.send(b"S 0")
    rig.wire.clock.sleep_s(0.02)
    rig.wire.reopen()
    rig.read()


@case("3.2/1")
def a_line_of_full_length_is_accepted(rig: Rig) -> None:
    """Send a command padded with spaces to 32 bytes."""
    rig.angle_in(rig.ask(b"H".ljust(LINE_LIMIT)))


@case("3.2/2")
def a_longer_line_is_refused(rig: Rig) -> None:
    """Send lines of 33, of 257 (1 in an 8-bit counter) and of 500 bytes, 33 spaces, and a line in two pieces."""
    for line in (b"H".ljust(LINE_LIMIT + 1), b"H" * 33, b"H".ljust(257), b"P".ljust(500), b" " * (LINE_LIMIT + 1)):
        rig.refused(line, ErrorCode.LINE_TOO_LONG)
    rig.wire.send(b"H".ljust(20))
    rig.wire.clock.sleep_s(20 * rig.profile.byte_s + 0.02)
    rig.refused(b"".ljust(20), ErrorCode.LINE_TOO_LONG)
    rig.read()


@case("3.2/3")
def a_bad_byte_spoils_its_line(rig: Rig) -> None:
    """Send lines with a byte that is not printable ASCII, at every position."""
    for byte in (0x00, 0x04, 0x08, 0x09, 0x11, 0x18, 0x1B, 0x1F, 0x7F, 0x80, 0xFF):
        rig.refused(bytes((byte,)) + b"H", ErrorCode.BAD_BYTE)
        rig.refused(b"H" + bytes((byte,)), ErrorCode.BAD_BYTE)
    rig.refused(b"S 1\xb50", ErrorCode.BAD_BYTE)


@case("3.2/4", ERROR_REPLIES)
def the_first_fault_is_answered(rig: Rig) -> None:
    """Send lines that are too long and contain a bad byte, before and after the length limit."""
    rig.refused(b"H\xff" + b" " * 40, ErrorCode.BAD_BYTE)
    rig.refused(b"H".ljust(40) + b"\xff", ErrorCode.LINE_TOO_LONG)
    rig.refused(b"x".ljust(31) + b"\x01" + b"y" * 40, ErrorCode.BAD_BYTE)
    rig.refused(b" " * 32 + b"\x01", ErrorCode.LINE_TOO_LONG)


@case("3.2/5")
def a_faulty_line_leaves_the_next_alone(rig: Rig) -> None:
    """Send `H` after each kind of fault: it has its reply."""
    for line, code in (
        (b"\x00", ErrorCode.BAD_BYTE),
        (b"9" * 100, ErrorCode.LINE_TOO_LONG),
        (b"?", ErrorCode.UNKNOWN_COMMAND),
        (b"P x", ErrorCode.BAD_NUMBER),
    ):
        rig.refused(line, code)
        rig.read()
