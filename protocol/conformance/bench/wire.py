"""Read and write lines with their times, and record every byte."""

import logging
from itertools import pairwise
from typing import Literal, NamedTuple, Protocol

from protocol.clock import Clock, clock_of
from protocol.port import Port

_log = logging.getLogger(__name__)

CR = b"\r"

_LONGEST_LINE = 256
"""Bytes without a CR up to this limit are an incomplete line; beyond it they are not a line."""

_FLOOD = 20_000
"""More bytes than any table sends in reply."""


class ReopenablePort(Port, Protocol):
    """A pyserial port that can be opened again."""

    def open(self) -> None:
        """Open the port."""
        ...


class Event(NamedTuple):
    """An event at one time: the bytes of a write, a received line (at its first byte), or an action of the rig."""

    time_s: float
    direction: Literal["sent", "received", "beside"]
    data: bytes


class RecordedPort:
    """A port that records all traffic.

    Attributes:
        inner: the port itself.
        clock: the clock of the port, simulated or real.
        events: the recorded traffic, in order.
    """

    def __init__(self, port: ReopenablePort) -> None:
        self.inner: ReopenablePort = port
        self.clock: Clock = clock_of(port)
        self.events: list[Event] = []

    @property
    def timeout(self) -> float | None:
        """The maximum time that `read` waits, in seconds."""
        return self.inner.timeout

    @timeout.setter
    def timeout(self, timeout_s: float | None) -> None:
        self.inner.timeout = timeout_s

    @property
    def in_waiting(self) -> int:
        """The number of bytes that can be read without waiting."""
        return self.inner.in_waiting

    def read(self, size: int, /) -> bytes:
        """Return `size` bytes, or fewer after `timeout`."""
        data = self.inner.read(size)
        if data:
            last = self.events[-1] if self.events else None
            if last is not None and last.direction == "received" and not last.data.endswith(CR):
                self.events[-1] = last._replace(data=last.data + data)
            else:
                self.events.append(Event(self.clock.now_s(), "received", data))
            if data.endswith(CR):
                _log.debug("received %r", self.events[-1].data)
        return data

    def write(self, data: bytes, /) -> int | None:
        """Send all of `data`."""
        _log.debug("sent %r", data)
        self.events.append(Event(self.clock.now_s(), "sent", data))
        return self.inner.write(data)

    def note(self, deed: str) -> None:
        """Record an action of the rig on the table."""
        self.events.append(Event(self.clock.now_s(), "beside", deed.encode()))

    def open(self) -> None:
        """Open the port again."""
        self.inner.open()

    def close(self) -> None:
        """Close the port."""
        self.inner.close()


class Line(NamedTuple):
    """A received line without its CR, the times of its first byte and of its CR, and its longest gap."""

    text: bytes
    first_s: float
    last_s: float
    gap_s: float = 0.0


class Wire:
    """Sends bytes, and collects lines with the times of their bytes.

    Each byte takes `byte_s` to reach the table. A wait for a reply starts when the last byte has arrived.
    """

    def __init__(self, port: RecordedPort, byte_s: float = 0.0) -> None:
        self.port = port
        self.clock = port.clock
        self._byte_s = byte_s
        self._sent_s = self.clock.now_s()
        self._rest = bytearray()
        self._times: list[float] = []

    def send(self, data: bytes) -> float:
        """Send bytes and return the time just before the first one."""
        now_s = self.clock.now_s()
        self._sent_s = max(self._sent_s, now_s) + len(data) * self._byte_s
        self.port.write(data)
        return now_s

    def read_line(self, timeout_s: float) -> Line | None:
        """Return the next line, or None when none is complete in time."""
        deadline_s = self._from_now_s(timeout_s)
        while (end := self._rest.find(CR)) < 0:
            left_s = deadline_s - self.clock.now_s()
            if (left_s < 0.0 and len(self._rest) > _LONGEST_LINE) or not self._receive(left_s):
                return None
        text, times = bytes(self._rest[:end]), self._times[: end + 1]
        del self._rest[: end + 1], self._times[: end + 1]
        gaps = (later - earlier for earlier, later in pairwise(times))
        return Line(text, times[0], times[-1], max(gaps, default=0.0))

    def listen(self, duration_s: float) -> bytes:
        """Return and discard everything that was received or is received within this time."""
        deadline_s = self._from_now_s(duration_s)
        while (left_s := deadline_s - self.clock.now_s()) > 0.0:
            self._receive(left_s)
        return self.forget()

    def drain(self, quiet_s: float, patience_s: float) -> bytes:
        """Return and discard everything that is received until the line is silent for a while, or the patience is over.

        A device that sends without end is not waited for.
        """
        deadline_s = self._from_now_s(patience_s)
        heard = b""
        while more := self.listen(quiet_s):
            heard += more
            if self.clock.now_s() >= deadline_s or len(heard) > _FLOOD:
                break
        return heard

    def forget(self) -> bytes:
        """Return and discard the received bytes that were not read as a line."""
        heard = bytes(self._rest)
        self._rest.clear()
        self._times.clear()
        return heard

    def reopen(self) -> None:
        """Close and open the port, as a new client does."""
        self.port.note("reopen")
        self.port.close()
        self.forget()
        self.port.open()

    def _from_now_s(self, duration_s: float) -> float:
        """Return after a time that starts when all sent bytes have arrived."""
        return max(self._sent_s, self.clock.now_s()) + duration_s

    def _receive(self, timeout_s: float) -> bool:
        """Wait for a byte. At the deadline, check once more whether one is available. Return False when there is none.

        On a busy machine this program may see a byte late although it arrived in time.
        """
        self.port.timeout = max(timeout_s, 0.0)
        data = self.port.read(1)
        self._rest += data
        self._times += [self.clock.now_s()] * len(data)
        return bool(data)
