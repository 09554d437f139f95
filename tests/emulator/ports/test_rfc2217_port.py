"""The telnet port: it transmits settings and all bytes, and no client can make it fail."""

import random
import socket
import struct
import threading
from collections.abc import Callable, Iterator
from typing import Any

import pytest
import serial
from hypothesis import given, settings
from hypothesis import strategies as st
from serial import rfc2217
from serial.rfc2217 import COM_PORT_OPTION, IAC, SB, SE

from emulator.line.framing import read_at_rate
from emulator.ports.rfc2217_port import Rfc2217Port

pytestmark = pytest.mark.filterwarnings("ignore:set(Daemon|Name):DeprecationWarning")  # pyserial's client calls them

ANY_BYTES = bytes(range(256))


class Served:
    """A port that is polled until the end of the test, as by the server."""

    def __init__(self, port: Rfc2217Port) -> None:
        self.port = port
        self.heard = bytearray()
        self.reply = b""
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._serve)
        self._thread.start()

    def _serve(self) -> None:
        while not self._ended.wait(0.001):
            data = self.port.receive().data
            self.heard += data
            if data.endswith(b"\r") and self.reply:
                self.port.send(self.reply)
            self.port.flush()

    def end(self) -> None:
        self._ended.set()
        self._thread.join()
        self.port.close()


@pytest.fixture
def served(warnings: list[str]) -> Iterator[Served]:
    served = Served(Rfc2217Port("127.0.0.1", 0, 9600, warnings.append))
    yield served
    served.end()


def connect(served: Served, baud: int = 9600, **options: Any) -> rfc2217.Serial:  # noqa: ANN401  # whatever pyserial takes
    port = serial.serial_for_url(served.port.name, baudrate=baud, timeout=5.0, **options)
    assert isinstance(port, rfc2217.Serial)
    return port


def connect_raw(port: Rfc2217Port) -> socket.socket:
    host, _, number = port.name.removeprefix("rfc2217://").rpartition(":")
    return socket.create_connection((host, int(number)), timeout=5.0)


def request(option: int, value: bytes = b"") -> bytes:
    return IAC + SB + COM_PORT_OPTION + bytes((option,)) + value.replace(IAC, IAC + IAC) + IAC + SE


def test_all_bytes_come_through_both_ways(served: Served, wait_until: Callable[[Callable[[], bool]], None]) -> None:
    served.reply = ANY_BYTES
    with connect(served) as client:
        client.write(ANY_BYTES + b"\r")
        assert client.read(256) == ANY_BYTES
        wait_until(lambda: len(served.heard) == 257)
    assert served.heard == ANY_BYTES + b"\r"


@pytest.mark.parametrize("baud", [4800, 19200, 115200])
def test_another_rate_is_garbage_both_ways_until_it_is_corrected(
    served: Served, warnings: list[str], wait_until: Callable[[Callable[[], bool]], None], baud: int
) -> None:
    with connect(served, baud) as client:
        client.write(b"P 90\r")
        garbage = read_at_rate(b"P 90\r", baud, 9600)
        wait_until(lambda: len(served.heard) >= len(garbage) > 0)
        assert served.heard != b"P 90\r"
        assert len(warnings) == 1
        assert f"set to {baud} baud and the table to 9600" in warnings[0]
        client.baudrate = 9600
        served.heard.clear()
        served.reply = b"H 0.0\r"
        client.write(b"H\r")
        assert client.read_until(b"\r") == b"H 0.0\r"
    with connect(served) as client:
        client.write(b"H\r")
        assert client.read_until(b"\r") == b"H 0.0\r"


def test_a_break_is_a_bad_byte(served: Served, wait_until: Callable[[Callable[[], bool]], None]) -> None:
    with connect(served) as client:
        client.write(b"H")
        client.send_break(0.01)
        client.write(b"\r")
        wait_until(lambda: served.heard.endswith(b"\r"))
    assert served.heard == b"H\0\r"


def test_modem_lines_let_a_client_go_on(served: Served) -> None:
    with connect(served) as client:
        assert (client.cts, client.dsr, client.cd, client.ri) == (True, True, True, False)
        client.dtr = False
        client.rts = False
        served.reply = b"OK\r"
        client.write(b"\r")
        assert client.read_until(b"\r") == b"OK\r"


@pytest.mark.parametrize(
    "options", [{"parity": serial.PARITY_EVEN}, {"bytesize": serial.SEVENBITS}, {"stopbits": serial.STOPBITS_TWO}]
)
def test_what_is_not_8n1_is_refused_to_the_client(served: Served, options: dict[str, Any]) -> None:
    with pytest.raises((ValueError, serial.SerialException)):
        connect(served, **options)


def test_purging_loses_no_answer_of_telnet(served: Served) -> None:
    served.reply = b"OK\r"
    with connect(served) as client:
        for _ in range(5):
            client.reset_input_buffer()
            client.reset_output_buffer()
            client.write(b"\r")
            assert client.read_until(b"\r") == b"OK\r"


def test_a_client_that_knows_nothing_of_telnet_is_served(served: Served) -> None:
    served.reply = b"H 0.0\r"
    with connect_raw(served.port) as client:
        client.sendall(b"H\r")
        received = b""
        while not received.endswith(b"\r"):
            received += client.recv(100)
    assert received.endswith(b"H 0.0\r")
    assert received.removesuffix(b"H 0.0\r")[::3].strip(IAC) == b""  # commands of three bytes


def test_a_second_client_is_turned_away(served: Served, warnings: list[str]) -> None:
    with connect(served), connect_raw(served.port) as second:
        assert second.recv(100) == b""
    assert "second client" in warnings[0]


TELNET = st.one_of(
    st.binary(max_size=20),
    st.builds(request, st.integers(0, 255), st.binary(max_size=6)),
    st.builds(
        lambda option, value: IAC + SB + bytes((option,)) + value + IAC + SE, st.integers(0, 255), st.binary(max_size=6)
    ),
    st.builds(lambda verb, option: bytes((255, verb, option)), st.integers(240, 254), st.integers(0, 255)),
    st.sampled_from(
        [IAC + SE, IAC + SB, IAC, IAC + SB + COM_PORT_OPTION + IAC + SE, request(1, struct.pack("!I", 2**32 - 1))]
    ),
)


@settings(max_examples=100)
@given(pieces=st.lists(TELNET, max_size=12), baud=st.sampled_from([0, 9600]))
def test_no_bytes_of_a_client_end_the_port_or_reach_the_next_client(pieces: list[bytes], baud: int) -> None:
    port = Rfc2217Port("127.0.0.1", 0, baud, lambda _sentence: None)
    for piece in (b"".join(pieces), b"".join(pieces[::-1])):
        with connect_raw(port) as client:
            port.receive()
            for start in range(0, len(piece), 7):
                client.sendall(piece[start : start + 7])
                port.receive()
                port.send(b"H 0.0\r")
        while port.client_count:
            port.receive()
    with connect_raw(port) as client:
        port.receive()
        client.sendall(b"H\r")
        heard = b""
        while not heard:
            heard = port.receive().data
        assert heard == b"H\r"
    port.close()


def test_a_request_without_end_and_answers_that_nobody_reads_take_no_memory(warnings: list[str]) -> None:
    port = Rfc2217Port("127.0.0.1", 0, 9600, warnings.append)
    chance = random.Random(1)  # noqa: S311  # a test's draw
    with connect_raw(port) as client:
        port.receive()
        client.sendall(IAC + SB + COM_PORT_OPTION + b"x" * 5000)
        for _ in range(40):
            port.receive()
        telnet = vars(port)["_telnet"]
        assert len(telnet.suboption) <= 64
        client.sendall(IAC + SE)
        client.setblocking(False)
        for _ in range(1000):
            try:
                client.send(request(1, struct.pack("!I", chance.randint(1, 10**6))) * 20)
            except BlockingIOError:
                break
            port.receive()
        assert len(vars(vars(port)["_outbox"])["_held"]) < 300_000
    port.close()
