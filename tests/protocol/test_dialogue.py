"""Commands and replies over a line that loses, delays and garbles replies: each command has its own reply."""

from contextlib import suppress
from decimal import Decimal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol import Command, CommandRefused, ErrorCode, ReplyTimeout, TableClient, TableError, UnexpectedReply, Verb
from tests.protocol.scripted_table import (
    Fate,
    TablePort,
    VirtualClock,
    client_in_place,
    cut,
    doubled,
    garbled,
    last_said,
    late,
    lost,
    prompt,
    replaced,
    torn,
)


def test_a_silent_table_is_told_from_one_that_says_something_else() -> None:
    client = client_in_place(port := TablePort())
    port.give_fates(lost)
    with pytest.raises(ReplyTimeout, match=r"sent b'H\\r', got nothing, .* within 1 s; check power"):
        client.position_deg()
    with pytest.raises(ReplyTimeout, match="got b'login:'"):
        TableClient(TablePort([replaced(b"login:\r")] * 9)).position_deg()


def test_a_time_out_tells_whether_the_command_was_sent() -> None:
    client = client_in_place(port := TablePort())
    port.give_fates(*[lost] * 10)
    with pytest.raises(ReplyTimeout, match=r"sent b'P 1.0\\r', .* it may have been executed"):
        client.move_to(1)
    with pytest.raises(ReplyTimeout, match="no other command was sent"):
        client.move_to(2)
    assert Command(Verb.MOVE_TO, Decimal(2)) not in port.heard


def test_a_time_out_takes_the_time_that_it_says() -> None:
    client = client_in_place(port := TablePort())
    port.give_fates(lost)
    before_s = port.clock.now_s()
    with pytest.raises(ReplyTimeout):
        client.position_deg()
    assert port.clock.now_s() - before_s == pytest.approx(1.0)


@pytest.mark.parametrize("fate", [lost, late(1.5), cut(3), torn(3, 1.5), garbled, replaced(b"OK\r"), replaced(b"hm\r")])
@pytest.mark.parametrize("strict", [False, True])
def test_after_a_spoilt_reply_the_next_answer_is_the_right_one(fate: Fate, strict: bool) -> None:
    client = client_in_place(port := TablePort(strict=strict))
    port.give_fates(fate)
    with pytest.raises((ReplyTimeout, UnexpectedReply)):
        client.position_deg()
    assert client.position_deg() == len(port.heard)
    port.clock.sleep_s(10)
    assert client.position_deg() == len(port.heard)


def test_a_late_refusal_does_not_refuse_the_next_command() -> None:
    client = client_in_place(port := TablePort())
    port.give_fates(late(1.001))
    with pytest.raises(ReplyTimeout):
        client.move_to(2000)
    client.move_to(20)
    assert last_said(port) == ("P", Decimal("20.0"))


def test_a_reply_that_came_twice_is_dropped_before_the_next_command() -> None:
    client = client_in_place(port := TablePort())
    port.give_fates(doubled)
    client.position_deg()
    port.clock.sleep_s(0.1)
    assert client.position_deg() == len(port.heard)


def test_finding_the_place_is_quick_however_long_the_table_was_away() -> None:
    client = client_in_place(port := TablePort())
    port.give_fates(*[lost] * 1000)
    for _ in range(300):
        with pytest.raises(ReplyTimeout):
            client.position_deg()
    port.give_fates()
    before = len(port.heard)
    assert client.position_deg() == len(port.heard)
    assert len(port.heard) - before < 10


def test_a_half_command_of_a_dead_client_is_never_carried_out() -> None:
    port = TablePort()
    port.write(b"P 12")
    assert TableClient(port).position_deg() == len(port.heard)
    assert ErrorCode.BAD_BYTE in port.heard
    assert not any(isinstance(heard, Command) and heard.verb == "P" for heard in port.heard)


@pytest.mark.parametrize("left_behind", [b"H\rP 1.0\rL\r", b"L\rP 1.0\rH\r"])
def test_the_replies_to_a_dead_client_are_not_those_to_the_next(left_behind: bytes) -> None:
    port = TablePort(latency_s=0.9)
    port.write(left_behind)
    port.clock.sleep_s(0.8)
    client = TableClient(port)
    for _ in range(4):
        assert client.position_deg() == len(port.heard)
        assert client.latched_deg() == len(port.heard)


def test_the_head_of_a_reply_that_came_too_late_does_not_spoil_the_next() -> None:
    client = client_in_place(port := TablePort(strict=True))
    port.give_fates(cut(3, delay_s=2))
    with pytest.raises(ReplyTimeout):
        client.position_deg()
    port.clock.sleep_s(5)
    assert client.position_deg() == len(port.heard)


fates = st.one_of(
    st.just(prompt),
    st.sampled_from([lost, garbled]),
    st.floats(0, 3).map(late),
    st.builds(cut, st.integers(0, 6), st.floats(0, 3)),
    st.builds(torn, st.integers(1, 6), st.floats(0, 3)),
)


@given(
    fates=st.lists(fates, max_size=20),
    latency_s=st.floats(0, 1.5),
    strict=st.booleans(),
    left_behind=st.permutations([b"H\r", b"L\r", b"P 1.0\r", b"X\r"]),
    half_line=st.sampled_from([b"", b"H", b"P 1", b"\xff"]),
    pause_s=st.floats(0, 1.5),
    said=st.lists(st.sampled_from(["H", "L", "P", "bad P"]), max_size=8),
)
def test_no_answer_is_ever_that_to_another_command(
    *,
    fates: list[Fate],
    latency_s: float,
    strict: bool,
    left_behind: list[bytes],
    half_line: bytes,
    pause_s: float,
    said: list[str],
) -> None:
    port = TablePort(fates, latency_s=latency_s, strict=strict)
    port.write(b"".join(left_behind) + half_line)
    port.clock.sleep_s(pause_s)
    client = TableClient(port)
    for what in said:
        with suppress(ReplyTimeout, UnexpectedReply):
            say_and_check(client, port, what)
    port.give_fates()
    port.clock.sleep_s(100)
    say_and_check(client, port, "H")


def say_and_check(client: TableClient, port: TablePort, what: str) -> None:
    """Let the client send a command; the reply must belong to the line that the table has received last."""
    match what:
        case "H":
            assert client.position_deg() == len(port.heard)
        case "L":
            assert client.latched_deg() == len(port.heard)
        case "P":
            client.move_to(1)
        case _:
            with pytest.raises(TableError) as refusal:
                client.move_to(2000)
            if not isinstance(refusal.value, CommandRefused):
                raise refusal.value


class StarvedClock(VirtualClock):
    """The clock of a program that continues two seconds after each look at it."""

    def now_s(self) -> float:
        self.time_s += 2.0
        return self.time_s


def test_a_reply_that_is_there_counts_however_late_the_client_looks() -> None:
    port = TablePort()
    port.clock = StarvedClock()
    assert TableClient(port, timeout_s=1.0).position_deg() > 0.0
