"""The first question to a table: where does it rest, and is it a table at all?"""

import re
from decimal import Decimal

from protocol.conformance.bench.host_watch import Watch
from protocol.conformance.bench.ports import SessionError
from protocol.conformance.bench.wire import Wire
from protocol.conformance.profile.profile import Profile

CANCEL = b"\x18\r"
"""Ends whatever half line a table holds, in such a way that it is not carried out (clause 8.3/1)."""

SETTLE_S = 0.3
"""Beyond the latency, a line on which nothing has come for so long is empty."""

PATIENCE_S = 30.0
"""How long a busy machine is given to calm down, and a table that is stopped to fall silent."""

_TALK_S = 10.0
"""How long a table may go on with its replies to whoever was there before."""

_POSITION = re.compile(rb"(?:^|[\r\n])H (-?[0-9]+\.[0-9]+) *\r")


def resting_position(wire: Wire, profile: Profile, watch: Watch) -> Decimal:
    """Return where the table rests; a machine that was late is given a second chance to hear it.

    Raises:
        SessionError: what is at the port does not answer, is no table of this protocol, or is in motion.
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
        raise SessionError(f"talks without being asked: {chatter[:40]!r}...; this is no table of this protocol")
    before, after = _reading(wire, profile), _reading(wire, profile)
    if before != after:
        raise SessionError(f"the table moves ({before}, then {after} deg); stop it first")
    return after


def _reading(wire: Wire, profile: Profile) -> Decimal:
    """Return a position, and let some time pass."""
    timeout_s = profile.serial.timeout_s
    wire.send(b"H\r")
    line = wire.read_line(timeout_s)
    heard = wire.forget() if line is None else line.text + b"\r"
    found = _POSITION.search(heard)
    if not heard:
        raise SessionError(
            f"no answer to 'H' within {timeout_s:g} s; is the table on, the cable right, "
            f"and its rate {profile.serial.baud} baud?"
        )
    if found is None:
        raise SessionError(f"'H' got {heard!r}, which is no position; this is no table of this protocol")
    wire.clock.sleep_s(SETTLE_S)
    return Decimal(found[1].decode())
