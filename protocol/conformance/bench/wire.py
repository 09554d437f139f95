"""The port as lines and times, with a record of every byte that passed."""

from itertools import pairwise
from typing import Literal, NamedTuple, Protocol

from protocol.clock import Clock, clock_of
from protocol.port import Port

CR = b"\r"

_LONGEST_LINE = 256
"""What comes without a CR is a line that goes on up to here, and no line beyond."""

_FLOOD = 20_000
"""More bytes than a table on any line says in answer to anything."""


class ReopenablePort(Port, Protocol):
    """A port of pyserial's, which can be opened again."""

    def open(self) -> None:
        """Take the port."""
        ...


class Event(NamedTuple):
    """What passed at one time: the bytes of a write, a line received (at its first byte), or a deed beside the wire."""

    time_s: float
    direction: Literal["sent", "received", "beside"]
    data: bytes


class RecordedPort:
    """A port that keeps what passes through it.

    Attributes:
        inner: the port itself.
        clock: that of the port, simulated or real.
        events: what passed, in order.
    """

    def __init__(self, port: ReopenablePort) -> None:
        self.inner: ReopenablePort = port
        self.clock: Clock = clock_of(port)
        self.events: list[Event] = []

    @property
    def timeout(self) -> float | None:
        """How long `read` waits, in seconds."""
        return self.inner.timeout

    @timeout.setter
    def timeout(self, timeout_s: float | None) -> None:
        self.inner.timeout = timeout_s

    @property
    def in_waiting(self) -> int:
        """The number of bytes that can be read at once."""
        return self.inner.in_waiting

    def read(self, size: int, /) -> bytes:
        """Return `size` bytes, or fewer when `timeout` has passed."""
        data = self.inner.read(size)
        if data:
            last = self.events[-1] if self.events else None
            if last is not None and last.direction == "received" and not last.data.endswith(CR):
                self.events[-1] = last._replace(data=last.data + data)
            else:
                self.events.append(Event(self.clock.now_s(), "received", data))
        return data

    def write(self, data: bytes, /) -> int | None:
        """Send all of `data`."""
        self.events.append(Event(self.clock.now_s(), "sent", data))
        return self.inner.write(data)

    def note(self, deed: str) -> None:
        """Record what is done to the table beside the wire."""
        self.events.append(Event(self.clock.now_s(), "beside", deed.encode()))

    def open(self) -> None:
        """Take the port again."""
        self.inner.open()

    def close(self) -> None:
        """Give the port back."""
        self.inner.close()


class Line(NamedTuple):
    """A received line without its CR, the times of its first byte and of its CR, and the longest gap in it."""

    text: bytes
    first_s: float
    last_s: float
    gap_s: float = 0.0


class Wire:
    """Sends bytes, and gathers lines with the times of their bytes.

    Bytes take `byte_s` each on their way to the table; what is waited for is waited for from the last of them on.
    """

    def __init__(self, port: RecordedPort, byte_s: float = 0.0) -> None:
        self.port = port
        self.clock = port.clock
        self._byte_s = byte_s
        self._sent_s = self.clock.now_s()
        self._rest = bytearray()
        self._times: list[float] = []

    def send(self, data: bytes) -> float:
        """Send bytes and return the time before the first of them."""
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
        """Return, and forget, all that has come and comes in this time."""
        deadline_s = self._from_now_s(duration_s)
        while (left_s := deadline_s - self.clock.now_s()) > 0.0:
            self._receive(left_s)
        return self.forget()

    def drain(self, quiet_s: float, patience_s: float) -> bytes:
        """Return, and forget, all that comes until nothing has come for a while, or patience ends.

        A device that floods is not heard out.
        """
        deadline_s = self._from_now_s(patience_s)
        heard = b""
        while more := self.listen(quiet_s):
            heard += more
            if self.clock.now_s() >= deadline_s or len(heard) > _FLOOD:
                break
        return heard

    def forget(self) -> bytes:
        """Return, and forget, what has been received and not been read as a line."""
        heard = bytes(self._rest)
        self._rest.clear()
        self._times.clear()
        return heard

    def reopen(self) -> None:
        """Leave the port and come back, as a new client does."""
        self.port.note("reopen")
        self.port.close()
        self.forget()
        self.port.open()

    def _from_now_s(self, duration_s: float) -> float:
        """Return when a time is over that begins when all that was sent has arrived."""
        return max(self._sent_s, self.clock.now_s()) + duration_s

    def _receive(self, timeout_s: float) -> bool:
        """Wait for a byte, or look whether one is there when time is up; return False when none came.

        A busy machine may keep this program from a byte that was in time.
        """
        self.port.timeout = max(timeout_s, 0.0)
        data = self.port.read(1)
        self._rest += data
        self._times += [self.clock.now_s()] * len(data)
        return bool(data)
