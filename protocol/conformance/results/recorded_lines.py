"""The recorded traffic as lines, with the times at which they reach the table of the replay; no I/O."""

import re
from collections.abc import Iterable, Iterator
from typing import NamedTuple

from protocol.conformance.bench.wire import CR
from protocol.conformance.profile.profile import Profile
from protocol.conformance.results.record import RecordedCase
from protocol.conformance.results.replay import AFTER_S

BEGIN = "begin"
_SPACES = re.compile(rb" +")


class Line(NamedTuple):
    """A line without its CR, at the arrival time of the CR; or an action of the rig, which has no text.

    The action `BEGIN` starts a case, with or without lines.

    A line is whole when a table that detects a disconnect cannot have discarded its start.
    """

    case: str
    time_s: float
    text: bytes
    deed: str = ""
    is_whole: bool = True


def recorded_lines(cases: Iterable[RecordedCase], profile: Profile) -> Iterator[Line]:
    """Yield lines and actions in order. Times count from the start of the replay."""
    begin_s = free_s = 0.0
    half = forgotten = b""  # the start time of a line; and the part before the client disconnected or canceled it
    for case in cases:
        now_s, origin_s = begin_s, case.wire[0].time_s
        forgotten, half = forgotten + half, b""  # the replay cancels it
        yield Line(case.id, begin_s, b"", BEGIN)
        for event in case.wire:
            now_s = max(now_s, begin_s + event.time_s - origin_s)
            if event.direction == "beside":
                forgotten, half = forgotten + half, b""
                yield Line(case.id, now_s, b"", event.data.decode())
            elif event.direction == "sent":
                *ends, rest = event.data.split(CR)
                for end in ends:
                    free_s = max(free_s, now_s) + (len(end) + 1) * profile.byte_s
                    if forgotten:
                        yield Line(case.id, free_s, forgotten + half + end, is_whole=False)
                    yield Line(case.id, free_s, half + end, is_whole=not forgotten)
                    half = forgotten = b""
                half += rest
                free_s = max(free_s, now_s) + len(rest) * profile.byte_s
        begin_s = max(now_s, free_s) + AFTER_S


def crowded_lines(case: RecordedCase, profile: Profile) -> Iterator[list[bytes]]:
    """Yield the lines that are sent without waiting for a reply, if they exceed the minimum buffer of a table.

    A table may lose some of these bytes, and join two lines into one.
    """
    sent = b""
    for event in (*case.wire, None):
        if event is not None and event.direction == "sent":
            sent += event.data
        elif event is None or event.direction == "received":
            if len(sent) > profile.serial.buffer_bytes:
                yield sorted({_SPACES.sub(b" ", line) for line in sent.split(CR)})
            sent = b""
