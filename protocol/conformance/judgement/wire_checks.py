"""Check the traffic on the line against the specification, byte by byte."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from decimal import Decimal

from protocol.conformance.bench.wire import CR, Line, Wire
from protocol.conformance.judgement.verdict import NonconformityError, require
from protocol.conformance.profile.profile import Profile
from protocol.messages import ANGLE_LETTERS, ErrorCode

QUIET_S = 0.05
"""A line that must stay silent is read for this time plus the latency."""

_PATIENCE_S = 60.0
"""At 300 baud, five times the buffer is answered within this time."""

_WHITE_SPACE = "a reply ends with CR only and has no space before it, clause 5.1/4"

_SHOWN = 40
"""This many bytes that are not a line are shown."""

_STAND_STILL_S = 0.15
"""Time in which a table turns by 0.11 deg at 10 deg/s2."""

_ANGLE = re.compile(rf"([{ANGLE_LETTERS}]) (-?(?:0|[1-9][0-9]*)\.([0-9]+))".encode())


class WireChecks:
    """Sends lines and checks their replies. A wrong reply raises NonconformityError.

    Attributes:
        wire: the table's line.
        profile: properties of the table.
    """

    def __init__(self, wire: Wire, profile: Profile) -> None:
        self.wire = wire
        self.profile = profile

    def ask(self, line: bytes) -> Line:
        """Send a line and return its reply.

        Raises:
            NonconformityError: no reply in time, or white space around it.
        """
        self.wire.send(line + CR)
        return self.reply_to(line)

    def reply_to(self, line: bytes) -> Line:
        """Return the next reply, which belongs to `line`."""
        reply = self.wire.read_line(self.profile.serial.timeout_s)
        if reply is None:
            heard = self.wire.forget()[:_SHOWN]
            without_cr = f", but {heard!r} without a CR" if heard else ""
            raise NonconformityError(f"{line!r} got no reply within {self.profile.serial.timeout_s:g} s{without_cr}")
        require(reply.text == reply.text.strip(), f"{line!r} got {reply.text!r}: {_WHITE_SPACE}")
        return reply

    def expect(self, line: bytes, reply: bytes = b"OK") -> Line:
        """Send a line and require an exact reply."""
        got = self.ask(line)
        require(got.text == reply, f"{line!r} got {got.text!r}, not {reply!r}")
        return got

    def refused(self, line: bytes, code: ErrorCode) -> None:
        """Send a line and require its refusal: by its error number, or by silence if the table has no error replies."""
        self.wire.send(line + CR)
        self.expect_refusal(line, code)

    def expect_refusal(self, line: bytes, code: ErrorCode) -> None:
        """Require the refusal of a line that was sent."""
        if not self.profile.serial.error_replies:
            self.silence(f"refused {line!r}")
            return
        got = self.reply_to(line)
        begins = b"ERR %d " % code
        require(got.text.startswith(begins), f"{line!r} got {got.text!r}, not {begins.decode()}{code.text}")

    def silence(self, why: str) -> None:
        """Require silence."""
        heard = self.wire.listen(QUIET_S + self.profile.serial.latency_s)
        require(bool(heard.strip()) or not heard, f"{why} got {heard!r}: {_WHITE_SPACE}")
        require(not heard, f"{why} got {heard!r}, not silence")

    def drain(self) -> bytes:
        """Return everything that is received until the line is silent.

        A table may be slow to reply (2.2/1 is a "should").
        """
        return self.wire.drain(self.profile.serial.latency_s + self.profile.serial.timeout_s / 3, _PATIENCE_S)

    def read(self, letter: bytes = b"H") -> Decimal:
        """Read a register; its reply must have exactly the form of clause 5.2."""
        return self.angle_in(self.ask(letter), letter)

    def angle_in(self, reply: Line, letter: bytes = b"H") -> Decimal:
        """Return the angle in a reply, or raise NonconformityError."""
        found = _ANGLE.fullmatch(reply.text)
        decimals = self.profile.serial.decimals
        if found is None or found[1] != letter or len(found[3]) != decimals:
            places = f"{decimals} decimal{'s' * (decimals > 1)}"
            raise NonconformityError(f"{letter!r} got {reply.text!r}, not {letter.decode()} and an angle with {places}")
        angle = Decimal(found[2].decode())
        require(
            angle != 0 or not found[2].startswith(b"-"),
            f"{letter!r} got {reply.text!r}: zero has no sign, clause 5.2/5",
        )
        return angle

    @contextmanager
    def unmoved(self, because: bytes) -> Iterator[None]:
        """Require that the table does not move during a `with` block."""
        before = self.read()
        yield
        self.wire.clock.sleep_s(_STAND_STILL_S)
        after = self.read()
        require(
            abs(after - before) <= Decimal(1).scaleb(-self.profile.serial.decimals),
            f"{because!r} moved the table from {before} to {after} deg",
        )


def number(value: float) -> bytes:
    """Return a number as text with at most four decimals."""
    return f"{value:.4f}".rstrip("0").removesuffix(".").encode()
