"""The serial line at the controller: bytes paced at the baud rate in both directions, and a small receive buffer.

Time is counted in integers: a tick adds `baud` units, and a byte (start, 8 data and stop bits) takes ten times
`tick_hz`.
"""

from collections import deque
from typing import Final

RECEIVE_LIMIT = 64
"""Maximum number of bytes that wait for the firmware.

When the buffer is full, bytes are lost, as on a small controller.
"""

TRANSMIT_LIMIT = 64
"""Maximum number of bytes that wait for the line. The firmware reads no further line while a reply might not fit."""

LOST: Final = None
"""Marks lost bytes in the receive buffer."""


class Wire:
    """One direction of the line. Its bytes follow each other without a gap."""

    def __init__(self, baud: int, tick_hz: int) -> None:
        self.queue: deque[int] = deque()
        self._tick_units = baud
        self._byte_units = 10 * tick_hz
        self._units = 0  # elapsed units of the first byte

    def advance(self) -> list[int]:
        """Return the bytes that are complete after a tick."""
        over = []
        if self.queue:
            self._units += self._tick_units
            while self.queue and self._units >= self._byte_units:
                self._units -= self._byte_units
                over.append(self.queue.popleft())
        if not self.queue:
            self._units = 0
        return over

    def ticks_until_byte(self) -> int:
        """Return the ticks until the first byte is complete; only while there is one."""
        return max(1, -(-(self._byte_units - self._units) // self._tick_units))

    def ticks_until(self, index: int) -> int:
        """Return the ticks until the byte at an index of the queue is complete."""
        return max(1, -(-((index + 1) * self._byte_units - self._units) // self._tick_units))

    def advance_by(self, ticks: int) -> list[int]:
        """Return the bytes that are complete after some ticks, as the same number of calls of `advance` would."""
        over: list[int] = []
        if self.queue:
            self._units += ticks * self._tick_units
            over.extend(self.queue.popleft() for _ in range(min(self._units // self._byte_units, len(self.queue))))
            self._units = self._units - len(over) * self._byte_units if self.queue else 0
        return over

    def clear(self) -> None:
        """Discard the bytes on the line."""
        self.queue.clear()
        self._units = 0


class Uart:
    """Both directions of a paced line. A baud rate of 0 is not handled here: such a line needs no wait."""

    def __init__(self, baud: int, tick_hz: int) -> None:
        """Start with an idle line."""
        self._incoming = Wire(baud, tick_hz)
        self._outgoing = Wire(baud, tick_hz)
        self._received: deque[int | None] = deque()
        self._sent = bytearray()
        self._never_overruns = baud <= RECEIVE_LIMIT * 10 * tick_hz  # bytes per tick
        self.lost_bytes = 0

    @property
    def idle(self) -> bool:
        """Whether no byte is on the line or waiting for the firmware."""
        return not (self._incoming.queue or self._outgoing.queue or self._received)

    @property
    def waiting_count(self) -> int:
        """Bytes in transmission to the firmware."""
        return len(self._incoming.queue) + len(self._received)

    @property
    def transmit_count(self) -> int:
        """Bytes that the firmware has written and the line has not yet transmitted."""
        return len(self._outgoing.queue)

    @property
    def transmit_room(self) -> int:
        """Number of bytes that the firmware may still write."""
        return TRANSMIT_LIMIT - len(self._outgoing.queue)

    def receive(self, data: bytes) -> None:
        """Take bytes that the client sends now."""
        self._incoming.queue.extend(data)

    def transmit(self) -> bytes:
        """Return and remove the bytes whose stop bit has been sent."""
        sent = bytes(self._sent)
        self._sent.clear()
        return sent

    def read(self) -> int | None:
        """Return the next byte for the firmware, or `LOST`; only while `readable`."""
        return self._received.popleft()

    @property
    def readable(self) -> bool:
        """Whether the receive buffer contains a byte."""
        return bool(self._received)

    def write(self, data: bytes) -> None:
        """Queue the firmware's bytes for the line."""
        self._outgoing.queue.extend(data)

    def advance(self) -> None:
        """Advance the line by one tick."""
        for byte in self._incoming.advance():
            self._store(byte)
        self._sent += bytes(self._outgoing.advance())

    def ticks_until_byte(self) -> int | None:
        """Return the ticks until the next byte is complete, in either direction; None on an idle line."""
        busy = (wire for wire in (self._incoming, self._outgoing) if wire.queue)
        return min((wire.ticks_until_byte() for wire in busy), default=None)

    @property
    def is_read_at_once(self) -> bool:
        """Whether the firmware reads each byte in the tick in which it is complete, as long as it has room to write."""
        return self._never_overruns and not self._received

    @property
    def outgoing(self) -> bytes:
        """The bytes that have not been sent yet, starting with the one on the line."""
        return bytes(self._outgoing.queue)

    def ticks_until_received(self, byte: int | None = None) -> int | None:
        """Return the ticks until a byte has been received, or else all bytes; None if it is not on the line."""
        queue = self._incoming.queue
        if not queue or (byte is not None and byte not in queue):
            return None
        return self._incoming.ticks_until(len(queue) - 1 if byte is None else queue.index(byte))

    def ticks_until_sent(self, count: int) -> int:
        """Return the ticks until the given number of bytes has been sent; so many are queued."""
        return self._outgoing.ticks_until(count - 1)

    def advance_by(self, ticks: int) -> bytes:
        """Advance a line that `is_read_at_once` by some ticks, and return the bytes received by the firmware."""
        self._sent += bytes(self._outgoing.advance_by(ticks))
        return bytes(self._incoming.advance_by(ticks))

    def disconnect(self) -> None:
        """Discard all bytes: the client has disconnected."""
        self._incoming.clear()
        self._outgoing.clear()
        self._received.clear()
        self._sent.clear()

    def _store(self, byte: int) -> None:
        if len(self._received) < RECEIVE_LIMIT:
            self._received.append(byte)
            return
        self.lost_bytes += 1
        if self._received[-1] is not LOST:
            self._received.append(LOST)
