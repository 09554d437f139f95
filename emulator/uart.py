"""The serial line at the controller: bytes paced at the baud rate both ways, and a small receive buffer.

Time is counted in integers: a tick brings `baud` units, a byte (start, 8 data and stop bit) takes ten times `tick_hz`.
"""

from collections import deque
from typing import Final

RECEIVE_LIMIT = 64
"""Bytes that wait for the firmware; what comes when it is full is lost, as on a small controller."""

TRANSMIT_LIMIT = 64
"""Bytes that wait for the line; the firmware reads no further line while a reply might not fit."""

LOST: Final = None
"""Stands in the receive buffer where bytes were lost."""


class Uart:
    """Both directions of a paced line. A baud rate of 0 is not its business: then there is no line to wait for."""

    def __init__(self, baud: int, tick_hz: int) -> None:
        """Start with an idle line."""
        self._baud = baud
        self._byte_units = 10 * tick_hz
        self._incoming: deque[int] = deque()
        self._incoming_units = 0
        self._received: deque[int | None] = deque()
        self._outgoing: deque[int] = deque()
        self._outgoing_units = 0
        self._sent = bytearray()
        self.lost_bytes = 0

    @property
    def idle(self) -> bool:
        """Whether nothing is on the line or waiting for the firmware."""
        return not (self._incoming or self._outgoing or self._received)

    @property
    def waiting_count(self) -> int:
        """Bytes on their way to the firmware."""
        return len(self._incoming) + len(self._received)

    @property
    def transmit_count(self) -> int:
        """Bytes that the firmware has written and the line has not yet carried."""
        return len(self._outgoing)

    @property
    def transmit_room(self) -> int:
        """Bytes that the firmware may still write."""
        return TRANSMIT_LIMIT - len(self._outgoing)

    def receive(self, data: bytes) -> None:
        """Take bytes that the client puts on the line now."""
        self._incoming.extend(data)

    def transmit(self) -> bytes:
        """Return the bytes whose stop bit has left, and forget them."""
        sent = bytes(self._sent)
        self._sent.clear()
        return sent

    def read(self) -> int | None:
        """Return the firmware's next byte, or `LOST`; only while `readable`."""
        return self._received.popleft()

    @property
    def readable(self) -> bool:
        """Whether the receive buffer holds something."""
        return bool(self._received)

    def write(self, data: bytes) -> None:
        """Queue the firmware's bytes for the line."""
        self._outgoing.extend(data)

    def advance(self) -> None:
        """Let one tick pass on the line."""
        if self._incoming:
            self._incoming_units += self._baud
            while self._incoming and self._incoming_units >= self._byte_units:
                self._incoming_units -= self._byte_units
                self._store(self._incoming.popleft())
        if not self._incoming:
            self._incoming_units = 0
        if self._outgoing:
            self._outgoing_units += self._baud
            while self._outgoing and self._outgoing_units >= self._byte_units:
                self._outgoing_units -= self._byte_units
                self._sent.append(self._outgoing.popleft())
        if not self._outgoing:
            self._outgoing_units = 0

    def ticks_until_byte(self) -> int | None:
        """Return the ticks until the next byte is over, in either direction; None on an idle line."""
        pending = [
            -(-(self._byte_units - units) // self._baud)
            for queue, units in ((self._incoming, self._incoming_units), (self._outgoing, self._outgoing_units))
            if queue
        ]
        return max(1, min(pending)) if pending else None

    def disconnect(self) -> None:
        """Forget what is on the line: the client has gone."""
        self._incoming.clear()
        self._received.clear()
        self._outgoing.clear()
        self._sent.clear()
        self._incoming_units = self._outgoing_units = 0

    def _store(self, byte: int) -> None:
        if len(self._received) < RECEIVE_LIMIT:
            self._received.append(byte)
            return
        self.lost_bytes += 1
        if self._received[-1] is not LOST:
            self._received.append(LOST)
