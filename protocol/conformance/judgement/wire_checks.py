"""What is said on the wire, held against the specification to the byte."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from decimal import Decimal

from protocol.conformance.bench.wire import CR, Line, Wire
from protocol.conformance.judgement.verdict import NonconformityError, require
from protocol.conformance.profile.profile import Profile
from protocol.messages import ANGLE_LETTERS, ErrorCode

QUIET_S = 0.05
"""What must stay silent is listened to for this long, and the latency."""

_PATIENCE_S = 60.0
"""Five times the buffer are answered within it at 300 baud."""

_WHITE_SPACE = "a reply ends in CR alone and has no space before it, clause 5.1/4"

_SHOWN = 40
"""Of bytes that are no line, so many are shown."""

_STAND_STILL_S = 0.15
"""At 10 deg/s2 a table makes 0.11 deg in it."""

_ANGLE = re.compile(rf"([{ANGLE_LETTERS}]) (-?(?:0|[1-9][0-9]*)\.([0-9]+))".encode())


class WireChecks:
    """Sends lines and requires their replies; what is not as it must be raises NonconformityError.

    Attributes:
        wire: the table's wire.
        profile: what is known of the table.
    """

    def __init__(self, wire: Wire, profile: Profile) -> None:
        self.wire = wire
        self.profile = profile

    def ask(self, line: bytes) -> Line:
        """Send a line and return its reply.

        Raises:
            NonconformityError: none came in time, or there is white space around it.
        """
        self.wire.send(line + CR)
        return self.reply_to(line)

    def reply_to(self, line: bytes) -> Line:
        """Return the next reply, which is that to `line`."""
        reply = self.wire.read_line(self.profile.serial.timeout_s)
        if reply is None:
            heard = self.wire.forget()[:_SHOWN]
            without_cr = f", but {heard!r} without a CR" if heard else ""
            raise NonconformityError(f"{line!r} got no reply within {self.profile.serial.timeout_s:g} s{without_cr}")
        require(reply.text == reply.text.strip(), f"{line!r} got {reply.text!r}: {_WHITE_SPACE}")
        return reply

    def expect(self, line: bytes, reply: bytes = b"OK") -> Line:
        """Send a line and require its very reply."""
        got = self.ask(line)
        require(got.text == reply, f"{line!r} got {got.text!r}, not {reply!r}")
        return got

    def refused(self, line: bytes, code: ErrorCode) -> None:
        """Send a line and require its refusal: by its number, or by silence where there are no error replies."""
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
        """Require that nothing comes."""
        heard = self.wire.listen(QUIET_S + self.profile.serial.latency_s)
        require(bool(heard.strip()) or not heard, f"{why} got {heard!r}: {_WHITE_SPACE}")
        require(not heard, f"{why} got {heard!r}, not silence")

    def drain(self) -> bytes:
        """Return all that comes until the line has fallen silent; a table may be slow to answer (2.2/1 is a should)."""
        return self.wire.drain(self.profile.serial.latency_s + self.profile.serial.timeout_s / 3, _PATIENCE_S)

    def read(self, letter: bytes = b"H") -> Decimal:
        """Read a register in exactly the form that clause 5.2 gives it."""
        return self.angle_in(self.ask(letter), letter)

    def angle_in(self, reply: Line, letter: bytes = b"H") -> Decimal:
        """Return the angle that a reply says, or raise NonconformityError."""
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
        """Require that the table stands still over a `with` block."""
        before = self.read()
        yield
        self.wire.clock.sleep_s(_STAND_STILL_S)
        after = self.read()
        require(
            abs(after - before) <= Decimal(1).scaleb(-self.profile.serial.decimals),
            f"{because!r} moved the table from {before} to {after} deg",
        )


def number(value: float) -> bytes:
    """Return a number as it goes on the wire, to four decimals at most."""
    return f"{value:.4f}".rstrip("0").removesuffix(".").encode()
