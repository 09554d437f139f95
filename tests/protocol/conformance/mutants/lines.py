"""Wrong tables: the serial line, and from bytes to lines."""

import re

from emulator.config import TableConfig
from emulator.faults import fault_from
from emulator.uart import Uart
from protocol.line_buffer import LineBuffer
from protocol.messages import ErrorCode
from tests.protocol.conformance.mutants.mutant import Line, Mutant, caught_by


@caught_by("2.1/3")
class HonoursXoff(Mutant):
    """XOFF silences it"""

    deaf = False

    def receive(self, data: bytes) -> None:
        self.deaf = self.deaf or b"\x13" in data
        if not self.deaf:
            super().receive(data)


@caught_by("2.2/2")
class AnswersAfterTheMotion(Mutant):
    """replies wait for the end of the motion"""

    def transmit(self) -> bytes:
        return b"" if self.moving else super().transmit()


@caught_by("2.3/1")
class SmallBuffer(Mutant):
    """the buffer holds 32 bytes"""

    def receive(self, data: bytes) -> None:
        super().receive(data[:32])


@caught_by("3.1/1")
class NeedsNoCr(Mutant):
    """a letter is answered without its CR"""

    def receive(self, data: bytes) -> None:
        super().receive(b"H\r" if data == b"H" else data)


@caught_by("3.1/2")
class LfEndsALine(Mutant):
    """LF ends a line"""

    def receive(self, data: bytes) -> None:
        super().receive(data.replace(b"\n", b"\r"))


@caught_by("3.1/3")
class AnswersEmptyLines(Mutant):
    """an empty line is an unknown command"""

    def receive(self, data: bytes) -> None:
        super().receive(data.replace(b"\r\r", b"\r?\r"))


@caught_by("3.1/5")
class KeepsHalfLines(Mutant):
    """the half line of a client that left meets the next one"""

    def disconnect(self) -> None:
        self._serial.uart.disconnect()


@caught_by("3.2/2")
class CutsLongLines(Mutant):
    """a long line is cut, and its beginning carried out"""

    def receive(self, data: bytes) -> None:
        super().receive(b"\r".join(line[:32] for line in data.split(b"\r")))


@caught_by("3.2/2")
class CountsInAByte(Mutant):
    """the length of a line is a byte, and begins anew after 255"""

    def receive(self, data: bytes) -> None:
        super().receive(re.sub(rb"([^\r])[^\r]{256}\r", rb"\1\r", data))


@caught_by("3.2/3")
class EditsItsLine(Mutant):
    """a backspace takes the byte before it back, for terminals"""

    def receive(self, data: bytes) -> None:
        super().receive(re.sub(rb"[^\r]?\x08", b"", data))


@caught_by("3.2/3")
class IgnoresBadBytes(Mutant):
    """bad bytes are passed over"""

    def receive(self, data: bytes) -> None:
        super().receive(bytes(byte for byte in data if 0x20 <= byte < 0x7F or byte in b"\r\n"))


@caught_by("2.1/1")
class IgnoresTheRate(Mutant):
    """its line is twelve times too fast"""

    def __init__(self, config: TableConfig, seed: int = 0) -> None:
        super().__init__(config, seed)
        self._serial.uart = Uart(12 * config.serial.baud, config.control.tick_hz)


@caught_by("2.2/1")
class ThinksLong(Mutant):
    """a reply takes a twentieth of a second"""

    def __init__(self, config: TableConfig, seed: int = 0) -> None:
        super().__init__(config, seed)
        self.inject(fault_from("delay", {"seconds": 0.05}))


@caught_by("2.2/3")
class ComputesInMidReply(Mutant):
    """it sends the letter, and then computes the angle for 30 ms"""

    unsent, next_tick = b"", 0

    def ticks_until_byte(self) -> int | None:
        return 1 if self.unsent else super().ticks_until_byte()

    def transmit(self) -> bytes:
        self.unsent += super().transmit()
        if self.tick < self.next_tick:
            return b""
        byte, self.unsent = self.unsent[:1], self.unsent[1:]
        self.next_tick = self.tick + 30 * byte.count(b"H")
        return byte


class ForgivingBuffer(LineBuffer):
    def spoil(self) -> None:
        """Overlook what was lost."""


@caught_by("2.3/2")
class OverlooksLostBytes(Mutant):
    """a line that lost bytes is read as if it were whole"""

    def __init__(self, config: TableConfig, seed: int = 0) -> None:
        super().__init__(config, seed)
        self._serial._lines = ForgivingBuffer()  # noqa: SLF001 - a wrong table reaches into itself


@caught_by("2.3/3")
class LocksUpWhenOverrun(Mutant):
    """an overrun shuts the receiver for good, as a flag that nobody clears"""

    def receive(self, data: bytes) -> None:
        if not self._serial.uart.lost_bytes:
            super().receive(data)


@caught_by("3.1/4")
class WantsWholeLines(Mutant):
    """a line counts only in one piece"""

    def receive(self, data: bytes) -> None:
        super().receive(data if data.endswith(b"\r") else b"")


@caught_by("3.2/1")
class ShortLines(Mutant):
    """a line has 31 bytes at most"""

    def receive(self, data: bytes) -> None:
        super().receive(re.sub(rb"[^\r]{32}\r", b" " * 33 + b"\r", data))


@caught_by("3.2/4")
class LengthBeforeBytes(Mutant):
    """of two faults that of length is answered"""

    def receive(self, data: bytes) -> None:
        super().receive(re.sub(rb"[^\r]{33,}\r", b" " * 33 + b"\r", data))


@caught_by("3.2/5")
class LongLinesDrag(Mutant):
    """a line too long spoils the next one"""

    spoiled = False

    def _reply(self, command: Line) -> bytes:
        reply = super()._reply(ErrorCode.BAD_BYTE if self.spoiled else command)
        self.spoiled = command is ErrorCode.LINE_TOO_LONG
        return reply
