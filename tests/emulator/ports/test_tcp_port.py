import socket
from collections.abc import Callable, Iterator

import pytest

from emulator.ports.port import Arrival
from emulator.ports.tcp_port import TcpPort, parse_address

WaitUntil = Callable[[Callable[[], bool]], None]


@pytest.fixture
def port(warnings: list[str]) -> Iterator[TcpPort]:
    port = TcpPort("127.0.0.1", 0, warnings.append)
    yield port
    port.close()


@pytest.fixture
def connect(port: TcpPort) -> Iterator[Callable[[], socket.socket]]:
    clients: list[socket.socket] = []

    def connect() -> socket.socket:
        host, _, number = port.name.removeprefix("socket://").rpartition(":")
        clients.append(socket.create_connection((host, int(number)), timeout=5.0))
        return clients[-1]

    yield connect
    for client in clients:
        client.close()


def received(port: TcpPort, wait_until: WaitUntil) -> Arrival:
    arrivals: list[Arrival] = []

    def anything() -> bool:
        arrivals.append(port.receive())
        return arrivals[-1] != Arrival()

    wait_until(anything)
    return arrivals[-1]


@pytest.mark.parametrize(
    ("text", "address"),
    [
        ("7000", ("127.0.0.1", 7000)),
        ("0", ("127.0.0.1", 0)),
        ("0.0.0.0:65535", ("0.0.0.0", 65535)),  # noqa: S104  # listening on every address is what is asked for here
        ("table.local:7000", ("table.local", 7000)),
        ("[::1]:7000", ("::1", 7000)),
        (":7000", ("127.0.0.1", 7000)),
    ],
)
def test_an_address_is_a_port_after_an_optional_host(text: str, address: tuple[str, int]) -> None:
    assert parse_address(text) == address


@pytest.mark.parametrize("text", ["", "x", "65536", "-1", "host:", "host:x", "::1:7000", "7000:", "1e3", "٣"])
def test_what_is_no_address_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="HOST:"):
        parse_address(text)


def test_the_name_is_a_url_with_the_port_that_was_picked(port: TcpPort) -> None:
    assert port.name.startswith("socket://127.0.0.1:")
    assert int(port.name.rpartition(":")[2]) > 0


def test_bytes_go_both_ways(port: TcpPort, connect: Callable[[], socket.socket], wait_until: WaitUntil) -> None:
    client = connect()
    client.sendall(b"H\r")
    assert received(port, wait_until) == Arrival(data=b"H\r")
    port.send(b"H 0.0\r")
    assert client.recv(100) == b"H 0.0\r"


def test_a_client_may_go_and_another_come(
    port: TcpPort, connect: Callable[[], socket.socket], wait_until: WaitUntil
) -> None:
    first = connect()
    first.sendall(b"P 9")
    assert received(port, wait_until) == Arrival(data=b"P 9")
    first.close()
    assert received(port, wait_until) == Arrival(left_after=True)
    connect().sendall(b"H\r")
    assert received(port, wait_until) == Arrival(data=b"H\r")


def test_a_second_client_is_turned_away_and_the_first_stays(
    port: TcpPort, connect: Callable[[], socket.socket], wait_until: WaitUntil, warnings: list[str]
) -> None:
    first = connect()
    first.sendall(b"H\r")
    assert received(port, wait_until) == Arrival(data=b"H\r")
    second = connect()
    wait_until(lambda: port.receive() == Arrival() and bool(warnings))
    assert second.recv(1) == b""
    assert "second client" in warnings[0]
    first.sendall(b"L\r")
    assert received(port, wait_until) == Arrival(data=b"L\r")


def test_an_unread_client_blocks_nothing_and_is_spoken_of_once(
    port: TcpPort, connect: Callable[[], socket.socket], wait_until: WaitUntil, warnings: list[str]
) -> None:
    client = connect()
    client.sendall(b"H\r")
    received(port, wait_until)
    # The system's own buffers of a loopback connection take some megabytes first.
    while not warnings:
        port.send(b"H 0.0\r" * 10_000)
    assert "does not read" in warnings[0]
    assert port.output_descriptors
    assert len(warnings) == 1


def test_a_reply_without_a_client_is_lost(
    port: TcpPort, connect: Callable[[], socket.socket], wait_until: WaitUntil
) -> None:
    port.send(b"H 0.0\r")
    client = connect()
    client.sendall(b"H\r")
    received(port, wait_until)
    port.send(b"H 1.0\r")
    assert client.recv(100) == b"H 1.0\r"


def test_a_client_that_resets_the_connection_has_left(
    port: TcpPort, connect: Callable[[], socket.socket], wait_until: WaitUntil
) -> None:
    client = connect()
    client.sendall(b"P 9")
    received(port, wait_until)
    client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\x01\0\0\0\0\0\0\0")
    client.close()
    port.send(b"OK\r")
    assert received(port, wait_until) == Arrival(left_after=True)


@pytest.mark.parametrize("host", ["0.0.0.0", "::"])  # noqa: S104  # what is to be warned of
def test_a_port_that_other_computers_reach_is_said_to_be_open(host: str, warnings: list[str]) -> None:
    try:
        port = TcpPort(host, 0, warnings.append)
    except OSError:
        pytest.skip("this machine has no such address")
    port.close()
    assert len(warnings) == 1
    assert "anyone with network access can move the table" in warnings[0]


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", "::1"])
def test_a_port_of_this_computer_alone_is_not(host: str, warnings: list[str]) -> None:
    try:
        port = TcpPort(host, 0, warnings.append)
    except OSError:
        pytest.skip("this machine has no such address")
    port.close()
    assert warnings == []
