from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from protocol import ErrorCode, LineBuffer

wire_bytes = st.lists(
    st.sampled_from([b"H", b"P 12.5", b" ", b"\r", b"\n", b"\r\n", b"x" * 31, b"x" * 33, b"\x04", b"\xff"]), max_size=20
).map(b"".join)


def in_one_piece(data: bytes, limit: int = 32) -> list[bytes | ErrorCode]:
    return LineBuffer(limit).feed(data)


def test_a_line_ends_in_cr() -> None:
    assert in_one_piece(b"H\rP 1.0\rL") == [b"H", b"P 1.0"]


def test_lf_is_ignored_wherever_it_stands() -> None:
    assert in_one_piece(b"\nP 1\n2.0\r\n\r\n") == [b"P 12.0"]


def test_empty_lines_and_lines_of_spaces_are_ignored() -> None:
    assert in_one_piece(b"\r\r   \rH\r\r") == [b"H"]


def test_a_line_of_the_limit_passes_and_one_byte_more_is_dropped_whole() -> None:
    assert in_one_piece(b"x" * 32 + b"\r" + b"x" * 33 + b"\rH\r") == [b"x" * 32, ErrorCode.LINE_TOO_LONG, b"H"]


def test_too_many_spaces_are_a_line_too_long() -> None:
    assert in_one_piece(b" " * 33 + b"\r") == [ErrorCode.LINE_TOO_LONG]


def test_a_byte_outside_printable_ascii_spoils_its_line_alone() -> None:
    assert in_one_piece(b"P 1\x042\rH\r\x80\r\t\r") == [
        ErrorCode.BAD_BYTE,
        b"H",
        ErrorCode.BAD_BYTE,
        ErrorCode.BAD_BYTE,
    ]


def test_the_first_fault_of_a_line_is_the_one_told() -> None:
    assert in_one_piece(b"\xff" + b"x" * 40 + b"\r" + b"x" * 40 + b"\xff\r") == [
        ErrorCode.BAD_BYTE,
        ErrorCode.LINE_TOO_LONG,
    ]


def test_a_discarded_half_line_is_not_glued_to_the_next() -> None:
    lines = LineBuffer()
    assert lines.feed(b"P 1\xff") == []
    lines.discard()
    assert lines.feed(b"H\r") == [b"H"]


def test_a_line_that_lost_bytes_does_not_pass_for_a_whole_one() -> None:
    lines = LineBuffer()
    assert lines.feed(b"P 1") == []
    lines.spoil()
    assert lines.feed(b"0.0\rH\r") == [ErrorCode.BAD_BYTE, b"H"]


def test_a_line_of_which_everything_was_lost_is_told_too() -> None:
    lines = LineBuffer()
    lines.spoil()
    assert lines.feed(b"\rH\r") == [ErrorCode.BAD_BYTE, b"H"]


@given(data=st.one_of(wire_bytes, st.binary(max_size=200)), cuts=st.lists(st.integers(0, 200), max_size=8))
def test_how_the_stream_is_split_makes_no_difference(data: bytes, cuts: list[int]) -> None:
    edges = [0, *sorted(cut for cut in cuts if cut < len(data)), len(data)]
    lines = LineBuffer()
    split = [line for start, end in pairwise(edges) for line in lines.feed(data[start:end])]
    assert split == in_one_piece(data)


@given(wire_bytes)
def test_lines_agree_with_a_byte_at_a_time_reading_of_the_specification(data: bytes) -> None:
    expected: list[bytes | ErrorCode] = []
    line, fault = b"", None
    for byte in data:
        if byte == 0x0A:
            continue
        if byte == 0x0D:
            if fault is not None:
                expected.append(fault)
            elif line.strip():
                expected.append(line)
            line, fault = b"", None
        elif fault is None and len(line) == 32:
            fault = ErrorCode.LINE_TOO_LONG
        elif fault is None and not 0x20 <= byte <= 0x7E:
            fault = ErrorCode.BAD_BYTE
        else:
            line += bytes([byte])
    assert in_one_piece(data) == expected


def test_a_line_without_end_is_not_kept() -> None:
    lines = LineBuffer()
    for _ in range(100):
        assert lines.feed(b"x" * 100_000) == []
    assert lines.feed(b"\rH\r") == [ErrorCode.LINE_TOO_LONG, b"H"]
