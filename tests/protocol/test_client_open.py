"""The client on ports that pyserial itself opens."""

import pytest

from protocol import PortError, ReplyTimeout, TableClient, WallClock


def test_a_port_that_is_not_there_is_a_port_error() -> None:
    with pytest.raises(PortError, match="cannot open /dev/no-such-table at 9600 baud"):
        TableClient.open("/dev/no-such-table")


def test_an_unknown_kind_of_url_is_a_port_error() -> None:
    with pytest.raises(PortError, match="cannot open telepathy://table"):
        TableClient.open("telepathy://table")


def test_a_line_that_only_echoes_is_no_table() -> None:
    with (
        TableClient.open("loop://", timeout_s=0.05) as client,
        pytest.raises(ReplyTimeout, match=r"sent b'[HL]\\r', got b'[HL]'"),
    ):
        client.position_deg()


def test_a_port_without_a_clock_of_its_own_lives_in_real_time() -> None:
    with TableClient.open("loop://") as client:
        assert isinstance(client.clock, WallClock)
        before_s = client.clock.now_s()
        client.clock.sleep_s(0.01)
        assert client.clock.now_s() - before_s >= 0.01
