"""The table seen by its client: each line and its reply."""

import math
from fractions import Fraction
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from emulator.table.table import Table
from protocol.line_buffer import LineBuffer
from tests.emulator.table_bench import PACED, UNPACED, ask, move, statuses


class TestTheWire:
    @pytest.mark.parametrize(
        ("line", "reply"),
        [
            (b"X 1", b"ERR 1 unknown command"),
            (b"h", b"ERR 1 unknown command"),
            (b"P", b"ERR 2 bad number"),
            (b"P 1e400", b"ERR 2 bad number"),
            (b"P nan", b"ERR 2 bad number"),
            (b"P --5", b"ERR 2 bad number"),
            (b"P 5.", b"ERR 2 bad number"),
            (b"P .5", b"ERR 2 bad number"),
            (b"H 1", b"ERR 2 bad number"),
            (b"P 99999999999999", b"ERR 3 out of range"),
            (b"R -99999999999999", b"ERR 3 out of range"),
            (b"S 0", b"ERR 3 out of range"),
            (b"S -1", b"ERR 3 out of range"),
            (b"S 40.1", b"ERR 3 out of range"),
            (b"A 0.0", b"ERR 3 out of range"),
            (b"A 100.000001", b"ERR 3 out of range"),
            (b"P " + b"0" * 31, b"ERR 4 line too long"),
            (b"P 1\x00", b"ERR 5 bad byte"),
            (b"\xff", b"ERR 5 bad byte"),
            (b"P +5", b"OK"),
            (b"P" + b"0" * 30 + b"5", b"OK"),
            (b"\nS\n 40.0 \n", b"OK"),
        ],
    )
    def test_each_line_has_its_reply(self, line: bytes, reply: bytes) -> None:
        table = Table(UNPACED)
        table.receive(line + b"\r")
        assert table.transmit() == reply + b"\r"

    @pytest.mark.parametrize("line", [b"", b"   ", b"\n", b"\r\n\r\n"])
    def test_an_empty_line_has_none(self, line: bytes) -> None:
        table = Table(UNPACED)
        table.receive(line + b"\r")
        assert table.transmit() == b""

    def test_strict_table_1_has_no_error_replies(self) -> None:
        table = Table(UNPACED.with_serial(strict=True))
        assert ask(table, "X", "P x", "S 99", "H") == b"H 0.000000\r"

    def test_an_angle_has_the_decimals_that_are_configured_and_no_negative_zero(self) -> None:
        table = Table(UNPACED.with_serial(decimals=1))
        assert ask(table, "H", "L") == b"H 0.0\rL 0.0\r"
        move(table, "S 40", "A 100", "P -0.04")
        assert table.status().encoder_deg < 0.0
        assert ask(table, "H") == b"H 0.0\r"
        move(table, "P -725.3")
        assert ask(table, "H").startswith(b"H -725.")

    @settings(max_examples=60, deadline=None)
    @given(
        data=st.lists(
            st.sampled_from(
                [b"H\r", b"L\r", b"S 400\r", b"P 1e9\r", b"A 0\r", b"\r", b"\n", b"R\r", b"\x00", b"\xff\r"]
            )
            | st.binary(max_size=40).filter(lambda data: not set(b"PRSA") & set(data))
        ).map(b"".join),
        cuts=st.lists(st.integers(0, 400), max_size=6),
    )
    def test_whatever_comes_is_answered_line_by_line_and_leaves_the_motion_alone(
        self, data: bytes, cuts: list[int]
    ) -> None:
        """At any split of the bytes; no line of these moves the table."""
        undisturbed, table = Table(UNPACED), Table(UNPACED)
        for moving in (undisturbed, table):
            ask(moving, "S 20", "A 50", "R 30")
            moving.advance(50)
        cuts = sorted({0, *(min(cut, len(data)) for cut in cuts), len(data)})
        for start, end in pairwise(cuts):
            table.receive(data[start:end])
        replies = table.transmit()
        assert replies.count(b"\r") == len(LineBuffer().feed(data))
        undisturbed.advance(50)
        table.advance(50)
        assert table.snapshot().state == undisturbed.snapshot().state

    def test_the_line_is_paced_both_ways(self) -> None:
        """At 9600 baud `H` and its CR take 2.08 ms, the 6 bytes of the reply 6.25 ms more, each to the tick."""
        table = Table(PACED)
        table.receive(b"H\r")
        heard = [table.transmit() for _ in statuses(table, 12)]
        assert b"".join(heard) == b"H 0.0\r"
        assert [tick for tick, byte in enumerate(heard, start=1) if byte] == [
            3 + math.ceil(n / 0.96) for n in range(1, 7)
        ]

    def test_a_half_line_goes_with_the_client_that_began_it(self) -> None:
        for config in (PACED, UNPACED):
            table = Table(config)
            table.receive(b"P 9")
            table.advance(10)
            table.disconnect()
            table.receive(b"H\r")
            table.advance(30)
            assert table.transmit().startswith(b"H 0.0")

    @settings(max_examples=12, deadline=None)
    @given(lines=st.lists(st.integers(1, 3999), min_size=30, max_size=80), pause=st.integers(0, 15))
    def test_a_client_that_outruns_the_line_never_moves_the_table_by_a_damaged_line(
        self, lines: list[int], pause: int
    ) -> None:
        """Each S sets a speed that is not a part of another line.

        So every set value was sent, and every reply is whole.
        """
        table, sent, seen, replies = Table(PACED), set(), set(), b""
        for number in lines:
            text = f"{number / 100:.2f}"
            sent.add(Fraction(text))
            table.receive(f"H\rH\rH\rS {text}\r".encode())
            for _ in range(pause):
                table.advance(1)
                seen.add(table.snapshot().registers.speed)
                replies += table.transmit()
        for _ in range(200):
            table.advance(10)
            seen.add(table.snapshot().registers.speed)
            replies += table.transmit()
        registers = {round(speed * 512 / 1000 * 2**26) for speed in sent | {Fraction(10)}}
        assert seen <= registers
        assert set(replies.split(b"\r")) <= {b"", b"OK", b"H 0.0", b"ERR 5 bad byte"}
        if pause == 0:
            assert table.status().lost_bytes > 0
