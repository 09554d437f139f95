"""The client's verbs, its errors, stopping and arrival, with a table in virtual time."""

from collections.abc import Callable
from decimal import Decimal

import pytest

from protocol import (
    ArrivalTimeout,
    Command,
    CommandRefused,
    ErrorCode,
    PortError,
    ProtocolMisuse,
    ReplyTimeout,
    TableClient,
)
from tests.protocol.scripted_table import DeadPort, MovingTablePort, TablePort, client_in_place, last_said, lost


def test_each_verb_has_its_method() -> None:
    port = TablePort()
    client = client_in_place(port)
    assert client.position_deg() == len(port.heard)
    assert last_said(port) == ("H", None)
    assert client.latched_deg() == len(port.heard)
    assert last_said(port) == ("L", None)
    client.move_to(-12.34)
    assert last_said(port) == ("P", Decimal("-12.3"))
    client.move_by(Decimal(10))
    assert last_said(port) == ("R", Decimal("10.0"))
    client.set_speed(20)
    assert last_said(port) == ("S", Decimal("20.0"))
    client.set_acceleration(5.5)
    assert last_said(port) == ("A", Decimal("5.5"))


def test_more_decimals_are_sent_when_asked_for() -> None:
    port = TablePort()
    TableClient(port, decimals=3).move_to(0.0625)
    assert last_said(port) == ("P", Decimal("0.062"))


def test_in_place_each_command_is_one_line() -> None:
    port = TablePort()
    client = client_in_place(port)
    before = len(port.heard)
    for _ in range(10):
        client.move_by(1)
    assert len(port.heard) == before + 10


def test_leaving_the_block_closes_the_port() -> None:
    port = TablePort()
    with TableClient(port) as client:
        client.position_deg()
    assert not port.is_open


def test_a_refusal_tells_what_was_sent_what_came_back_and_what_to_do() -> None:
    client = client_in_place(TablePort())
    with pytest.raises(
        CommandRefused, match=r"sent b'P 2000.0\\r', got ERR 3 out of range: use a value .* limits"
    ) as refusal:
        client.move_to(2000)
    assert refusal.value.code is ErrorCode.OUT_OF_RANGE
    assert client.position_deg() > 0


@pytest.mark.parametrize("value", [float("nan"), float("inf"), 1e40])
def test_misuse_sends_nothing(value: float) -> None:
    port = TablePort()
    with pytest.raises(ProtocolMisuse):
        TableClient(port).move_to(value)
    assert port.heard == []


def test_a_dead_port_is_a_port_error() -> None:
    with pytest.raises(PortError, match=r"could not be sent; check the table"):
        TableClient(DeadPort()).position_deg()


def test_stop_is_sent_at_once_even_when_replies_are_missing() -> None:
    client = client_in_place(port := TablePort())
    port.give_fates(*[lost] * 10)
    with pytest.raises(ReplyTimeout):
        client.move_by(90)
    before, begun_s = len(port.heard), port.clock.now_s()
    port.write = stopped_at(port.write, port, begun_s)  # type: ignore[method-assign] # a spy in its place
    with pytest.raises(AssertionError, match="the stop was sent"):
        client.stop()
    verbs = [heard.verb for heard in port.heard[before:] if isinstance(heard, Command)]
    assert verbs == ["A", "R"]


def stopped_at(write: Callable[[bytes], int], port: TablePort, begun_s: float) -> Callable[[bytes], int]:
    """Return a write that ends the test after `R` was sent, without any elapsed time."""

    def spy(data: bytes) -> int:
        write(data)
        assert b"R" not in data or port.clock.now_s() > begun_s, "the stop was sent"
        return len(data)

    return spy


def test_arrival_is_two_readings_in_a_row_at_the_target() -> None:
    port = MovingTablePort(speed_deg_s=10, target_deg=30)
    seen: list[float] = []
    assert TableClient(port).wait_until_at(30, timeout_s=10, progress=seen.append) == 30
    assert seen == sorted(seen)
    assert seen[-2:] == [30, 30]
    assert port.clock.now_s() == pytest.approx(3.0, abs=0.3)


def test_a_table_that_passes_by_has_not_arrived() -> None:
    client = TableClient(MovingTablePort(speed_deg_s=10, target_deg=90))
    with pytest.raises(ArrivalTimeout, match=r"the table is at 90\.0 deg") as arrival:
        client.wait_until_at(30, tolerance_deg=0.25, timeout_s=20)
    assert arrival.value.position_deg == 90


def test_a_difference_of_just_the_tolerance_is_an_arrival() -> None:
    client = TableClient(MovingTablePort(speed_deg_s=100, target_deg=12.4))
    assert client.wait_until_at(12.35, tolerance_deg=0.05) == 12.4
