"""The controller's end of the line, with a firmware that returns every line."""

import pytest

from emulator.config.table_config import load_config
from emulator.faults.fault import fault_from
from emulator.faults.schedule import FaultSchedule
from emulator.table.serial_end import Lines, SerialEnd
from protocol.messages import ErrorCode

TICK_HZ = 1000


class Echo:
    """A serial end, the faults of its line, and a firmware that stores the received lines."""

    def __init__(self, baud: int) -> None:
        self.faults = FaultSchedule((), TICK_HZ, seed=0)
        self.end = SerialEnd(load_config().with_serial(baud=baud), self.faults)
        self.lines: list[bytes | ErrorCode] = []
        self.tick = 0

    def answer(self, lines: Lines) -> None:
        for line in lines:
            self.lines.append(line)
            self.end.write(b"bad\r" if isinstance(line, ErrorCode) else line + b"\r", self.tick)

    def receive(self, data: bytes) -> None:
        self.answer(self.end.receive(data))

    def advance(self, ticks: int) -> bytes:
        """Advance some ticks and return the bytes sent in them."""
        for _ in range(ticks):
            self.tick += 1
            self.end.release(self.tick)
            self.answer(self.end.advance())
        return self.end.transmit()


def test_without_pacing_lines_are_answered_in_the_call_that_brings_them() -> None:
    echo = Echo(baud=0)
    echo.receive(b"one\rtwo\rthr")
    assert echo.end.transmit() == b"one\rtwo\r"
    assert echo.end.ticks_until_byte(0) is None
    echo.receive(b"ee\r")
    assert (echo.end.transmit(), echo.lines) == (b"three\r", [b"one", b"two", b"three"])


def test_a_paced_line_is_answered_when_its_bytes_have_come() -> None:
    """10 bits a byte at 10 000 baud: a byte takes a tick, in and out."""
    echo = Echo(baud=10_000)
    echo.receive(b"one\r")
    assert [echo.advance(1) for _ in range(9)] == [b"", b"", b"", b"", b"o", b"n", b"e", b"\r", b""]


def test_the_firmware_reads_no_line_whose_reply_might_not_fit() -> None:
    echo = Echo(baud=10_000)
    for _ in range(8):
        echo.receive(b"x" * 31 + b"\r")
        echo.advance(32)
    assert echo.end.uart.transmit_count <= 64
    assert echo.advance(40) == b"x" * 31 + b"\r"
    assert len(echo.lines) == 8


def test_bytes_that_the_buffer_lost_spoil_their_line() -> None:
    echo = Echo(baud=1_000_000)  # 100 bytes a tick
    echo.receive(b"H\r" * 31 + b"P 123\r")
    echo.advance(2)
    echo.receive(b"45\rH\r")
    echo.advance(2)
    assert echo.end.uart.lost_bytes == 4
    assert echo.lines == [b"H"] * 31 + [ErrorCode.BAD_BYTE, b"H"]


@pytest.mark.parametrize("baud", [0, 10_000])
def test_a_client_that_goes_takes_its_half_line_and_its_replies_with_it(baud: int) -> None:
    echo = Echo(baud)
    echo.faults.inject(fault_from("delay", {"seconds": 0.1}), 0)
    echo.receive(b"late\rhal")
    echo.advance(10)
    echo.end.disconnect()
    assert echo.advance(200) == b""
    echo.receive(b"new\r")
    assert echo.advance(200) == b"new\r"


def test_a_reply_that_is_held_back_is_awaited_as_a_byte_is() -> None:
    echo = Echo(baud=0)
    echo.faults.inject(fault_from("delay", {"seconds": 0.05}), 0)
    echo.receive(b"one\r")
    assert (echo.end.transmit(), echo.end.held_until, echo.end.ticks_until_byte(20)) == (b"", 50, 30)
    assert (echo.advance(49), echo.advance(1)) == (b"", b"one\r")


def test_what_passes_the_firmware_can_be_overheard_once() -> None:
    echo = Echo(baud=0)
    echo.receive(b"one\rtw")
    assert echo.end.overheard() == (b"one\rtw", b"one\r")
    assert echo.end.overheard() == (b"", b"")
