"""The client on ports that pyserial itself opens."""

import pytest

from protocol import PortError, ReplyTimeout, TableClient


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
