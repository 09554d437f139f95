"""The paced line: exact in integers, with the losses of a small controller."""

from fractions import Fraction
from math import ceil

import pytest
from hypothesis import given
from hypothesis import strategies as st

from emulator.line.uart import LOST, Uart

TICK_HZ = 1000
bauds = st.sampled_from([300, 9600, 19200, 57600, 115200])


def read_all(uart: Uart) -> list[int | None]:
    found = []
    while uart.readable:
        found.append(uart.read())
    return found


@pytest.mark.parametrize("baud", [300, 9600, 115200])
@pytest.mark.parametrize("length", [1, 7, 5000])
def test_a_stream_of_bytes_takes_ten_bits_each_to_the_tick(baud: int, length: int) -> None:
    """Both ways, and nothing is lost to rounding over a long run: byte n is over at 10 n / baud seconds."""
    uart, heard, said = Uart(baud, TICK_HZ), [], []
    expected = [ceil(Fraction(10 * n * TICK_HZ, baud)) for n in range(1, length + 1)]
    uart.receive(bytes(length))
    uart.write(bytes(length))
    for tick in range(1, expected[-1] + 1):
        uart.advance()
        heard += [tick] * len(read_all(uart))
        said += [tick] * len(uart.transmit())
    assert heard == said == expected
    assert uart.idle


@given(baud=bauds, chunks=st.lists(st.binary(min_size=1, max_size=20), max_size=10))
def test_all_bytes_come_through_in_order(baud: int, chunks: list[bytes]) -> None:
    uart, heard, said = Uart(baud, TICK_HZ), [], b""
    for chunk in chunks:
        uart.receive(chunk)
        uart.write(chunk)
    while not uart.idle:
        uart.advance()
        heard += read_all(uart)
        said += uart.transmit()
    assert heard == list(b"".join(chunks))
    assert said == b"".join(chunks)
    assert uart.lost_bytes == 0


@given(baud=bauds, incoming=st.binary(max_size=9), outgoing=st.binary(max_size=9), passed=st.integers(0, 30))
def test_the_next_byte_comes_exactly_when_announced(baud: int, incoming: bytes, outgoing: bytes, passed: int) -> None:
    uart = Uart(baud, TICK_HZ)
    uart.receive(incoming)
    uart.write(outgoing)
    for _ in range(passed):
        uart.advance()
    read_all(uart)
    uart.transmit()
    announced = uart.ticks_until_byte()
    if announced is None:
        assert uart.idle
        return
    for _ in range(announced - 1):
        uart.advance()
    assert (read_all(uart), uart.transmit()) == ([], b"")
    uart.advance()
    assert (read_all(uart), uart.transmit()) != ([], b"")


def test_a_full_receive_buffer_loses_bytes_and_marks_each_gap_once() -> None:
    uart = Uart(10_000, TICK_HZ)  # a byte a tick
    uart.receive(bytes(range(70)))
    for _ in range(70):
        uart.advance()
    assert uart.lost_bytes == 6
    assert read_all(uart) == [*range(64), LOST]
    uart.receive(b"\x07")
    uart.advance()
    assert read_all(uart) == [7]


def test_room_that_opens_after_a_loss_is_used_behind_the_mark() -> None:
    uart = Uart(10_000, TICK_HZ)
    uart.receive(bytes(range(65)))
    for _ in range(65):
        uart.advance()
    assert [uart.read(), uart.read()] == [0, 1]
    uart.receive(b"ab")
    uart.advance()
    uart.advance()
    assert read_all(uart) == [*range(2, 64), LOST, ord("a"), LOST]
    assert uart.lost_bytes == 2


def test_time_on_an_idle_line_is_not_saved_up() -> None:
    uart = Uart(9600, TICK_HZ)
    for _ in range(1000):
        uart.advance()
    uart.receive(b"x")
    assert uart.ticks_until_byte() == 2  # 1.04 ms


def test_who_disconnects_leaves_nothing_behind() -> None:
    uart = Uart(9600, TICK_HZ)
    uart.receive(b"abc")
    uart.write(b"def")
    for _ in range(3):
        uart.advance()
    uart.disconnect()
    assert uart.idle
    assert (uart.transmit(), uart.ticks_until_byte(), uart.waiting_count, uart.transmit_count) == (b"", None, 0, 0)
