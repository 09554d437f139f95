"""The first command to a table: check that it is a table of this protocol, and read its rest position."""

import re
from decimal import Decimal

from protocol.conformance.bench.host_watch import Watch
from protocol.conformance.bench.ports import SessionError
from protocol.conformance.bench.wire import Wire
from protocol.conformance.profile.profile import Profile

CANCEL = b"\x18\r"
"""Ends an incomplete line at the table without executing it (clause 8.3/1)."""

SETTLE_S = 0.3
"""A line is empty when it has been silent for this time plus the latency."""

PATIENCE_S = 30.0
"""Time allowed for a busy machine to calm down, and for a stopped table to fall silent."""

_TALK_S = 10.0
"""Time for which a table may continue with its replies to an earlier client."""

_POSITION = re.compile(rb"(?:^|[\r\n])H (-?[0-9]+\.[0-9]+) *\r")


def resting_position(wire: Wire, profile: Profile, watch: Watch) -> Decimal:
    """Return the rest position of the table. If the testing machine was late, try a second time.

    Raises:
        SessionError: the device at the port does not reply, is not a table of this protocol, or is moving.
    """
    watch.restart()
    try:
        return _asked(wire, profile)
    except SessionError:
        if watch.late_s() <= profile.serial.latency_s:
            raise
    watch.wait_for_calm(profile.serial.latency_s, PATIENCE_S)
    return _asked(wire, profile)


def _asked(wire: Wire, profile: Profile) -> Decimal:
    wire.send(CANCEL)
    quiet_s = SETTLE_S + profile.serial.latency_s
    if wire.drain(quiet_s, _TALK_S) and (chatter := wire.listen(quiet_s)):
        raise SessionError(f"sends without a command: {chatter[:40]!r}...; this is not a table of this protocol")
    before, after = _reading(wire, profile), _reading(wire, profile)
    if before != after:
        raise SessionError(f"the table moves ({before}, then {after} deg); stop it first")
    return after


def _reading(wire: Wire, profile: Profile) -> Decimal:
    """Return a position, and wait for some time."""
    timeout_s = profile.serial.timeout_s
    wire.send(b"H\r")
    line = wire.read_line(timeout_s)
    heard = wire.forget() if line is None else line.text + b"\r"
    found = _POSITION.search(heard)
    if not heard:
        raise SessionError(
            f"no reply to 'H' within {timeout_s:g} s; check the power of the table, the cable, "
            f"and the baud rate (here {profile.serial.baud})"
        )
    if found is None:
        raise SessionError(f"'H' got {heard!r}, which is not a position; this is not a table of this protocol")
    wire.clock.sleep_s(SETTLE_S)
    return Decimal(found[1].decode())
