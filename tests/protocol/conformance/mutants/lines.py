"""Wrong tables: the serial line, and from bytes to lines."""

import re
from collections.abc import Callable

from emulator.config.table_config import TableConfig
from emulator.faults.fault import fault_from
from emulator.line.uart import Uart
from protocol.line_buffer import LineBuffer
from protocol.messages import ErrorCode
from tests.protocol.conformance.mutants.mutant import Line, Mutant, caught_by


@caught_by("2.1/3")
class HonorsXoff(Mutant):
    """XOFF stops its replies"""

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
    """the incomplete line of a client that left is joined to the next one"""

    def disconnect(self) -> None:
        self._serial.uart.disconnect()


@caught_by("3.2/2")
class CutsLongLines(Mutant):
    """a long line is cut, and its start executed"""

    def receive(self, data: bytes) -> None:
        super().receive(b"\r".join(line[:32] for line in data.split(b"\r")))


@caught_by("3.2/2")
class CountsInAByte(Mutant):
    """the length of a line is a byte, and starts again after 255"""

    def receive(self, data: bytes) -> None:
        super().receive(re.sub(rb"([^\r])[^\r]{256}\r", rb"\1\r", data))


@caught_by("3.2/2")
class CountsEachPieceAlone(Mutant):
    """the length of a line is that of its longest piece"""

    def receive(self, data: bytes) -> None:
        super().receive(data if len(data) > 32 else data.replace(b" ", b""))


@caught_by("3.2/3")
class EditsItsLine(Mutant):
    """a backspace deletes the previous byte, as on terminals"""

    def receive(self, data: bytes) -> None:
        super().receive(re.sub(rb"[^\r]?\x08", b"", data))


@caught_by("3.2/3")
class IgnoresBadBytes(Mutant):
    """bad bytes are ignored"""

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

    def ticks_until_sent(self, wanted: int) -> int | None:
        return 1 if self.unsent else super().ticks_until_sent(wanted)

    def transmit(self) -> bytes:
        self.unsent += super().transmit()
        if self.tick < self.next_tick:
            return b""
        byte, self.unsent = self.unsent[:1], self.unsent[1:]
        self.next_tick = self.tick + self.pause_ticks(byte)
        return byte

    def pause_ticks(self, byte: bytes) -> int:
        """Return how long it waits after a byte."""
        return 30 * byte.count(b"H")


class ForgivingBuffer(LineBuffer):
    def spoil(self) -> None:
        """Ignore lost bytes."""


@caught_by("2.3/2")
class OverlooksLostBytes(Mutant):
    """a line that lost bytes is read as if it were complete"""

    def __init__(self, config: TableConfig, seed: int = 0) -> None:
        super().__init__(config, seed)
        self._serial._lines = ForgivingBuffer()  # noqa: SLF001 - a wrong table reaches into itself


@caught_by("2.3/3")
class LocksUpWhenOverrun(Mutant):
    """an overrun stops the receiver permanently, because a flag is not cleared"""

    def receive(self, data: bytes) -> None:
        if not self._serial.uart.lost_bytes:
            super().receive(data)


@caught_by("3.1/4")
class WantsWholeLines(Mutant):
    """a line counts only if it arrives in one piece"""

    def receive(self, data: bytes) -> None:
        super().receive(data if data.endswith(b"\r") else b"")


@caught_by("3.2/1")
class ShortLines(Mutant):
    """a line has 31 bytes at most"""

    def receive(self, data: bytes) -> None:
        super().receive(re.sub(rb"[^\r]{32}\r", b" " * 33 + b"\r", data))


@caught_by("3.2/4")
class LengthBeforeBytes(Mutant):
    """of two faults the length error is reported"""

    def receive(self, data: bytes) -> None:
        super().receive(re.sub(rb"[^\r]{33,}\r", b" " * 33 + b"\r", data))


@caught_by("3.2/5")
class LongLinesDrag(Mutant):
    """a line that is too long makes the next one invalid"""

    spoiled = False

    def _reply(self, command: Line) -> bytes:
        reply = super()._reply(ErrorCode.BAD_BYTE if self.spoiled else command)
        self.spoiled = command is ErrorCode.LINE_TOO_LONG
        return reply


def forgets_half_lines(after_s: float) -> None:
    class ForgetsHalfLines(Mutant):
        __doc__ = f"a half line is forgotten after {after_s:g} s of silence"

        last_tick = 0

        def receive(self, data: bytes) -> None:
            if self.tick - self.last_tick > 1000 * after_s:
                self._serial._lines.discard()  # noqa: SLF001 - a wrong table reaches into itself
            self.last_tick = self.tick
            super().receive(data)

    caught_by("3.1/4")(ForgetsHalfLines)


for each_s in (0.1, 1.0, 5.0):
    forgets_half_lines(each_s)


@caught_by("3.1/4")
class SilenceEndsALine(Mutant):
    """an incomplete line is executed after 2 s of silence"""

    last_tick, is_half = 0, False

    def receive(self, data: bytes) -> None:
        super().receive(data)
        self.last_tick, self.is_half = self.tick, not data.endswith((b"\r", b"\n"))

    def ticks_until_sent(self, wanted: int) -> int | None:
        return 1 if self.is_half else super().ticks_until_sent(wanted)

    def advance(self, ticks: int) -> None:
        super().advance(ticks)
        if self.is_half and self.tick - self.last_tick > 2000:
            self.receive(b"\r")


@caught_by("3.1/2")
class SkipsWhatFollowsCr(Mutant):
    """after CR it waits for LF or for the next CR, if LF was received before"""

    def receive(self, data: bytes) -> None:
        super().receive(re.sub(rb"\r\n[^\r]*(?=\r)", b"\r", data))


def late(name: str, is_late: Callable[[bytes, int], bool], late_s: float = 0.025) -> None:
    class Late(Mutant):
        __doc__ = f"{name} comes {1000 * late_s:g} ms late"

        replies = 0

        def _answer(self, line: bytes | ErrorCode) -> bytes:
            reply = super()._answer(line)
            self.replies += 1
            if is_late(reply, self.replies):
                self.inject(fault_from("late-reply", {"seconds": late_s}))
            return reply

    caught_by("2.2/1")(Late)


def every(nth: int) -> Callable[[bytes, int], bool]:
    return lambda _, count: count % nth == 0


late("OK", lambda reply, _: reply == b"OK\r")
late("L", lambda reply, _: reply.startswith(b"L"))
late("a refusal", lambda reply, _: reply.startswith(b"ERR"))
late("the refusal of a number", lambda reply, _: reply.startswith(b"ERR 3"))
for nth in (20, 50, 200, 500):
    late(f"every {nth}th reply", every(nth), 0.03)


@caught_by("2.2/1")
class LateInMotion(Mutant):
    """in motion a reply comes 25 ms late"""

    def _answer(self, line: bytes | ErrorCode) -> bytes:
        reply = super()._answer(line)
        if self.moving:
            self.inject(fault_from("late-reply", {"seconds": 0.025}))
        return reply


@caught_by("2.2/3")
class StumblesAtTimes(ComputesInMidReply):
    """in every 50th reply it pauses for 30 ms"""

    replies = 0

    def pause_ticks(self, byte: bytes) -> int:
        self.replies += byte == b"\r"
        return 30 * (byte != b"\r" and self.replies % 50 == 49)
