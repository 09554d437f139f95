"""Send the recorded traffic to another table, and compare the replies."""

import re
from collections.abc import Sequence
from itertools import zip_longest
from typing import NamedTuple

from protocol.conformance.bench.stand import Stand
from protocol.conformance.bench.wire import CR, Event, Wire
from protocol.conformance.profile.profile import Profile
from protocol.conformance.results.record import RecordedCase
from protocol.messages import ANGLE_LETTERS

_ANGLE = re.compile(rf"([{ANGLE_LETTERS}]) (-?[0-9]+\.[0-9]+)".encode())
AFTER_S = 0.3
"""Time from the last event of a case to the start of the next case."""
_MOMENT_S = 0.001


class Parting(NamedTuple):
    """The first differing reply of a case: its index, and both replies."""

    reply: int
    time_s: float
    recorded: bytes | None
    now: bytes | None

    def __str__(self) -> str:
        recorded, now = (repr(line) if line else "nothing" for line in (self.recorded, self.now))
        return f"at {self.time_s:.3f} s, reply {self.reply}: recorded {recorded}, now {now}"


def replay(case: RecordedCase, wire: Wire, stand: Stand, profile: Profile) -> Parting | None:
    """Send the recorded bytes at their recorded times, and return the first differing reply.

    Two angles are equal if they differ by at most the tolerance of a table in motion plus its travel within the
    latency.
    """
    if not case.wire:
        return None
    origin_s, begin_s = case.wire[0].time_s, wire.clock.now_s()
    heard, due = bytearray(), 0
    for event in case.wire:
        if event.direction == "received":
            due += event.data.count(CR)
            continue
        heard += wire.listen(event.time_s - origin_s - (wire.clock.now_s() - begin_s))
        latest_s = wire.clock.now_s() + profile.serial.latency_s
        while event.direction == "beside" and heard.count(CR) < due and wire.clock.now_s() < latest_s:
            heard += wire.listen(_MOMENT_S)  # a power cycle would discard replies that the record has
        _do(event, wire, stand)
    heard += wire.listen(case.wire[-1].time_s - origin_s - (wire.clock.now_s() - begin_s) + AFTER_S)
    tolerance = profile.tolerance.tracking_deg + profile.resolution_deg
    tolerance += profile.serial.latency_s * profile.motion.speed_deg_s
    return _parting(case.wire, bytes(heard), tolerance)


def _do(event: Event, wire: Wire, stand: Stand) -> None:
    if event.direction == "sent":
        wire.send(event.data)
        return
    deed, _, count = event.data.decode().partition(" ")
    if deed == "reopen":
        wire.reopen()
    elif deed == "preset":
        stand.preset(int(count))
    elif deed == "power_cycle":
        stand.power_cycle()
    else:
        stand.trigger()


def _parting(events: Sequence[Event], heard: bytes, tolerance_deg: float) -> Parting | None:
    recorded = b"".join(event.data for event in events if event.direction == "received").split(b"\r")
    times = [event.time_s - events[0].time_s for event in events if event.direction == "received"] or [0.0]
    for index, (before, now) in enumerate(zip_longest(recorded, heard.split(b"\r"))):
        if before is None or now is None or not _same(before, now, tolerance_deg):
            return Parting(index + 1, times[min(index, len(times) - 1)], before, now)
    return None


def _same(before: bytes, now: bytes, tolerance_deg: float) -> bool:
    one, other = _ANGLE.fullmatch(before), _ANGLE.fullmatch(now)
    if one is None or other is None or one[1] != other[1]:
        return before == now
    return abs(float(one[2]) - float(other[2])) <= tolerance_deg
