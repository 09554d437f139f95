"""The effect of faults on the serial line: on bytes in transmission, and on replies before they are sent."""

from collections import deque

from emulator.faults.fault import Drop, Flip, HalfReply, LateReplies, LateReply, Silence, WrongBaud
from emulator.faults.schedule import FaultSchedule
from emulator.line.framing import read_at_rate
from protocol.bench import Fault

LINE_KINDS: frozenset[type[Fault]] = frozenset((Drop, Flip, LateReplies, HalfReply, LateReply, Silence, WrongBaud))
"""The faults that this module implements."""

TO_TABLE, TO_CLIENT = 1, -1
"""The direction of bytes, as in a fault's parameter `direction`; there 0 means both."""


class LineFaults:
    """Drops, changes and delays bytes, as the active faults require."""

    def __init__(self, baud: int, tick_hz: int, faults: FaultSchedule) -> None:
        """Start without delayed bytes, on a line of a baud rate (0: not paced) and for a firmware's clock."""
        self._faults = faults
        self._baud = baud
        self._tick_hz = tick_hz
        self._held: deque[tuple[int, bytes]] = deque()  # each with the tick at which it is sent

    @property
    def are_present(self) -> bool:
        """Whether a fault is active or scheduled."""
        return self._faults.present

    @property
    def held_until(self) -> int | None:
        """The tick at which delayed replies are sent; None if there are none."""
        return self._held[0][0] if self._held else None

    def on_the_line(self, data: bytes, direction: int) -> bytes:
        """Return the bytes that arrive at the table or at the client, after the effect of the faults."""
        faults = self._faults
        if not faults.present:
            return data
        if faults.hangs_up or (direction == TO_CLIENT and faults.holding(Silence)):
            return b""
        if (wrong := faults.holding(WrongBaud)) and self._baud:
            sender, receiver = (self._baud, wrong.baud) if direction == TO_TABLE else (wrong.baud, self._baud)
            data = read_at_rate(data, sender, receiver)
        if (drop := faults.holding(Drop)) and drop.direction in {0, direction}:
            data = bytes(byte for byte in data if not faults.strikes(drop.probability))
        if (flip := faults.holding(Flip)) and flip.direction in {0, direction}:
            data = bytes(self._flipped(byte, flip.probability) for byte in data)
        return data

    def on_a_reply(self, reply: bytes, tick: int) -> bytes:
        """Return the part of a reply that the table sends now. The rest is lost or delayed."""
        faults = self._faults
        if not (faults.present or self._held):
            return reply
        if half := faults.spent(HalfReply):
            reply = reply[: half.bytes]
        late_s = late.seconds if (late := faults.spent(LateReply)) else 0.0
        if delay := faults.holding(LateReplies):
            late_s += delay.seconds
        # A reply never overtakes the one before it.
        due = max(tick + round(late_s * self._tick_hz), self._held[-1][0] if self._held else tick)
        if due == tick:
            return reply
        self._held.append((due, reply))
        return b""

    def released(self, tick: int) -> bytes:
        """Return the replies that are due."""
        data = b""
        while self._held and self._held[0][0] <= tick:
            data += self._held.popleft()[1]
        return data

    def disconnect(self) -> None:
        """Discard the delayed replies: the client has disconnected."""
        self._held.clear()

    def _flipped(self, byte: int, probability: float) -> int:
        return byte ^ 1 << self._faults.chance.randrange(8) if self._faults.strikes(probability) else byte
