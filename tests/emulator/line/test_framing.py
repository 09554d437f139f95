import pytest
from hypothesis import given
from hypothesis import strategies as st

from emulator.line.framing import rates_agree, read_at_rate

STANDARD_RATES = [1200, 2400, 4800, 9600, 19200, 38400, 57600, 115200]


@given(st.binary(max_size=64), st.sampled_from(STANDARD_RATES))
def test_equal_rates_read_what_was_sent(data: bytes, baud: int) -> None:
    assert read_at_rate(data, baud, baud) == data


@pytest.mark.parametrize(("sender", "receiver"), [(9600, 9700), (9700, 9600), (9600, 9200)])
def test_rates_within_half_a_bit_in_nine_and_a_half_agree(sender: int, receiver: int) -> None:
    assert rates_agree(sender, receiver)
    assert read_at_rate(b"P 90.0\r", sender, receiver) == b"P 90.0\r"


@pytest.mark.parametrize("sender", STANDARD_RATES)
@pytest.mark.parametrize("receiver", STANDARD_RATES)
def test_other_standard_rates_read_garbage(sender: int, receiver: int) -> None:
    command = b"P 90.0\r"
    assert (read_at_rate(command, sender, receiver) == command) == (sender == receiver)


def test_half_rate_reads_each_pair_of_bits_as_one() -> None:
    # "U" alternates: start 0, then 1 0 1 0 1 0 1 0, stop 1. A receiver at half the rate samples at 1, 3, 5, ... bits:
    # the first sample, half a bit of its own after the edge, is a one, so that it sees no start bit.
    assert read_at_rate(b"U", sender_baud=9600, receiver_baud=4800) == b""
    # 0x00 is nine low bits: start sampled at 1 (low), data at 3, 5, 7 low, then the line is high.
    assert read_at_rate(b"\x00", sender_baud=9600, receiver_baud=4800) == b"\xf8"


def test_double_rate_reads_each_bit_twice() -> None:
    # Bits of 0xFF: one low, then always high. At twice the rate: start low, first data bit low, the rest high.
    assert read_at_rate(b"\xff", sender_baud=4800, receiver_baud=9600) == b"\xfe"
    # 0x00 holds the line low for 18 of the receiver's bits: one byte of zeros, and no second edge within it.
    assert read_at_rate(b"\x00", sender_baud=4800, receiver_baud=9600) == b"\x00"


def test_a_break_much_shorter_than_a_bit_is_no_start_bit() -> None:
    assert read_at_rate(b"\xff", sender_baud=115200, receiver_baud=1200) == b""


@given(st.binary(max_size=64), st.integers(50, 4_000_000), st.integers(50, 4_000_000))
def test_any_bytes_at_any_rates_are_read_as_some_bytes(data: bytes, sender: int, receiver: int) -> None:
    received = read_at_rate(data, sender, receiver)
    # A frame of the receiver takes at least 9.5 of its own bit times.
    assert len(received) <= 1 + len(data) * 10 * receiver / (9.5 * sender)
