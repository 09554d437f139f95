"""The controller's end of the serial line: it splits the client's bytes into lines, and sends replies as bytes.

With a baud rate, each byte takes its transmission time in both directions. At 0 there is no delay: a command is
answered within the call that sends it.
"""

from collections.abc import Iterator

from emulator.config.table_config import TableConfig
from emulator.faults.line_faults import TO_CLIENT, TO_TABLE, LineFaults
from emulator.faults.schedule import FaultSchedule
from emulator.line.uart import LOST, Uart
from protocol.line_buffer import LineBuffer
from protocol.messages import LINE_LIMIT, ErrorCode

_LONGEST_REPLY = LINE_LIMIT + 1
_LINE_END = 0x0D

Lines = Iterator[bytes | ErrorCode]
"""A line that the firmware has read, as `LineBuffer` returns it.

The reply to each line is written before the next one is read.
"""


class SerialEnd:
    """UART, line buffer and the faults of the line, between a client's bytes and the firmware's lines.

    Attributes:
        uart: the paced line; always idle without pacing.
    """

    def __init__(self, config: TableConfig, faults: FaultSchedule) -> None:
        """Start with an idle line."""
        self.uart = Uart(config.serial.baud, config.control.tick_hz)
        self._paced = config.serial.baud > 0
        self._lines = LineBuffer()
        self._faults = LineFaults(config.serial.baud, config.control.tick_hz, faults)
        self._sent = b""
        self._heard = self._said = b""  # since it was last observed

    def receive(self, data: bytes) -> Lines:
        """Take bytes that the client sends now; yield the lines that the firmware has now read."""
        data = self._faults.on_the_line(data, TO_TABLE)
        if self._paced:
            self.uart.receive(data)
        else:
            yield from self._read(data)

    def transmit(self) -> bytes:
        """Return and remove the bytes that have been sent by now."""
        sent, self._sent = self._sent, b""
        return sent

    def advance(self) -> Lines:
        """Advance the line by one tick; yield the lines that the firmware reads, as long as it has room for a reply."""
        uart = self.uart
        uart.advance()
        while uart.readable and uart.transmit_room >= _LONGEST_REPLY:
            byte = uart.read()
            if byte is LOST:
                self._lines.spoil()
            else:
                yield from self._read(bytes((byte,)))
        if sent := uart.transmit():
            self._send(sent)

    @property
    def needs_each_tick(self) -> bool:
        """Whether an event other than the end of a line is possible on the serial line."""
        uart = self.uart
        if uart.idle:
            return False
        return self._faults.are_present or not uart.is_read_at_once or uart.transmit_room < _LONGEST_REPLY

    def ticks_until_line(self) -> int | None:
        """Return the ticks until the firmware has a complete line; None if none is in transmission."""
        return self.uart.ticks_until_received(_LINE_END)

    def pass_ticks(self, ticks: int) -> Lines:
        """Advance by some ticks, as the same number of calls of `advance` would.

        The line needs no single ticks, and no line is complete before the last one.
        """
        if self.uart.idle:
            return
        if self.ticks_until_line() == ticks:
            yield from self._pass_quietly(ticks - 1)
            yield from self.advance()
        else:
            yield from self._pass_quietly(ticks)

    def ticks_until_sent(self, wanted: int, tick: int) -> int | None:
        """Return the ticks until `wanted` bytes may have been sent, or a line is complete; None if neither occurs.

        If faults may change bytes, it stops at every byte.
        """
        if self.needs_each_tick or self.held_until is not None:
            return self.ticks_until_byte(tick)
        if len(self.uart.outgoing) >= wanted:
            return self.uart.ticks_until_sent(wanted)
        line = self.ticks_until_line()
        return self.ticks_until_byte(tick) if line is None else line

    def write(self, reply: bytes, tick: int) -> None:
        """Pass a reply to the line."""
        self._put(self._faults.on_a_reply(reply, tick))

    @property
    def held_until(self) -> int | None:
        """The tick at which replies that a fault delays are sent; None if there are none."""
        return self._faults.held_until

    def release(self, tick: int) -> None:
        """Send the delayed replies that are due now."""
        if held := self._faults.released(tick):
            self._put(held)

    def ticks_until_byte(self, tick: int) -> int | None:
        """Return the ticks until the next byte in either direction is complete; None while the line is idle."""
        ticks, held_until = self.uart.ticks_until_byte(), self._faults.held_until
        if held_until is None:
            return ticks
        held = max(1, held_until - tick)
        return held if ticks is None else min(ticks, held)

    def disconnect(self) -> None:
        """Discard the client's incomplete line and the replies that it has not received: it has disconnected."""
        self.uart.disconnect()
        self._faults.disconnect()
        self._lines.discard()
        self._sent = b""

    def overheard(self) -> tuple[bytes, bytes]:
        """Return and clear what the firmware has read and what has been sent since the last call."""
        heard, said, self._heard, self._said = self._heard, self._said, b"", b""
        return heard, said

    def _pass_quietly(self, ticks: int) -> Lines:
        if data := self.uart.advance_by(ticks):
            yield from self._read(data)
        if sent := self.uart.transmit():
            self._send(sent)

    def _read(self, data: bytes) -> Lines:
        self._heard += data
        yield from self._lines.feed(data)

    def _put(self, reply: bytes) -> None:
        if self._paced:
            self.uart.write(reply)
        else:
            self._send(reply)

    def _send(self, data: bytes) -> None:
        data = self._faults.on_the_line(data, TO_CLIENT)
        self._sent += data
        self._said += data
