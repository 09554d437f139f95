import fcntl
import os
import select
import sys
import termios
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import ClassVar

import pytest
import serial

from emulator.ports.device_link import DeviceLink
from emulator.ports.outbox import LIMIT_BYTES
from emulator.ports.port import Arrival, spoiled
from emulator.ports.pty_port import READ_BYTES, PtyPort

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="what is known about ptys was measured on Linux")

PTY_BYTES = 40_000
"""More than the buffer of a pty in one direction."""

TIOCGEXCL = 0x80045440
"""Linux's question whether a terminal is locked; Python has no name for it."""

Open = Callable[[str], int]


@pytest.fixture
def port(warnings: list[str]) -> Iterator[PtyPort]:
    port = PtyPort(9600, warnings.append)
    yield port
    port.close()


@pytest.fixture
def unpaced_port(warnings: list[str]) -> Iterator[PtyPort]:
    port = PtyPort(0, warnings.append)
    yield port
    port.close()


def read_now(descriptor: int) -> bytes:
    return os.read(descriptor, 100_000) if select.select([descriptor], [], [], 0)[0] else b""


def test_a_new_port_neither_echoes_nor_translates(port: PtyPort, opened: Open) -> None:
    client = opened(port.name)
    os.write(client, b"H\r\n\x03\x04\x11\x7f\xff")
    assert port.receive().data == b"H\r\n\x03\x04\x11\x7f\xff"
    assert read_now(client) == b""
    port.send(b"H 0.0\r\n\x03\x04\xff")
    assert read_now(client) == b"H 0.0\r\n\x03\x04\xff"


def test_without_a_client_the_port_is_silent_rather_than_hung_up(port: PtyPort) -> None:
    assert select.select(port.input_descriptors, [], [], 0)[0] == []
    assert port.receive() == Arrival()


def test_a_client_that_comes_sends_and_goes_is_seen(port: PtyPort, opened: Open) -> None:
    client = opened(port.name)
    os.write(client, b"H\r")
    assert port.receive() == Arrival(data=b"H\r")
    os.close(client)
    assert select.select(port.input_descriptors, [], [], 0)[0] != []
    assert port.receive() == Arrival(left_after=True)
    assert port.receive() == Arrival()


def test_what_a_client_left_unread_in_the_pty_is_its_own(port: PtyPort, opened: Open) -> None:
    client = opened(port.name)
    os.write(client, b"P 9")
    os.close(client)
    opened(port.name)
    assert port.receive() == Arrival(data=b"P 9", left_after=True)


def test_what_the_next_client_sends_comes_after_the_first_one_left(port: PtyPort, opened: Open) -> None:
    client = opened(port.name)
    os.write(client, b"P 9")
    assert port.receive() == Arrival(data=b"P 9")
    os.close(client)
    os.write(opened(port.name), b"0\r")
    assert port.receive() == Arrival(left_before=True, data=b"0\r")


@pytest.mark.parametrize(
    ("first", "second"),
    [
        (b"R 9", b"0\r"),
        (b"R 9", b"0\rH\r"),
        (b"H\rR 9", b"0\rH\r"),
        (b"S 20\rR 9", b"0\r"),
        (b"S 20\rA 9\rR 9", b"0\rH\rH\r"),
        (b"R 9\r", b"H\r"),
        (b"R 9", b"0"),
        (b"S 20\rR 9", b"0"),
    ],
)
def test_bytes_of_two_clients_that_are_found_in_one_look_are_doubtful(
    port: PtyPort, opened: Open, first: bytes, second: bytes
) -> None:
    client = opened(port.name)
    os.write(client, first)
    os.close(client)
    os.write(opened(port.name), second)
    assert port.receive() == Arrival(left_before=True, data=first + second, is_doubtful=True)


@pytest.mark.parametrize(("second", "count"), [(b"\x18\rH\r", 0), (b"R 1\r", 1)])
def test_two_clients_in_one_look_are_warned_of_only_where_a_line_is_refused(
    port: PtyPort, opened: Open, warnings: list[str], second: bytes, count: int
) -> None:
    client = opened(port.name)
    os.write(client, b"H\r")
    os.close(client)
    os.write(opened(port.name), second)
    assert port.receive().is_doubtful
    assert len([sentence for sentence in warnings if "in immediate succession" in sentence]) == count


def test_bytes_that_came_after_the_last_look_may_be_of_a_client_that_left_then(port: PtyPort, opened: Open) -> None:
    client = opened(port.name)
    os.write(client, b"H\r" * READ_BYTES + b"R 9")  # more than one read takes
    port.receive()
    os.close(client)
    os.write(opened(port.name), b"0\r")
    arrival = port.receive()
    assert arrival.data.endswith(b"R 90\r")
    assert arrival.is_doubtful


@pytest.mark.parametrize(
    ("pieces", "is_doubtful"),
    [
        ([b"S 20\r", b"R 90\r"], True),
        ([b"S 20\rR 9", b"0\r"], True),
        ([b"R 9", b"0"], True),
        ([b"R 9", b"0\r", b"H\r"], True),
        ([b"R 9"], False),
        ([b"S 20\rR 90\r"], False),
    ],
)
def test_the_same_holds_for_clients_that_came_and_went(
    port: PtyPort, opened: Open, pieces: list[bytes], is_doubtful: bool
) -> None:
    for piece in pieces:
        client = opened(port.name)
        os.write(client, piece)
        os.close(client)
    assert port.receive() == Arrival(data=b"".join(pieces), left_after=True, is_doubtful=is_doubtful)


@pytest.mark.parametrize("modes", [termios.ECHO, termios.ECHONL | termios.ICANON, termios.ECHO | termios.ICANON])
def test_an_echo_that_a_client_switches_on_is_switched_off_again(
    port: PtyPort, opened: Open, warnings: list[str], modes: int
) -> None:
    client = opened(port.name)
    settings = termios.tcgetattr(client)
    settings[0] |= termios.ICRNL
    settings[3] |= modes
    termios.tcsetattr(client, termios.TCSANOW, settings)
    port.receive()
    for _ in range(3):
        port.send(b"H 0.0\r\n")
        assert port.receive() == Arrival()
    assert not termios.tcgetattr(client)[3] & (termios.ECHO | termios.ECHONL)
    assert [sentence for sentence in warnings if "echo" in sentence] == warnings
    assert len(warnings) == 1


class Slow(PtyPort):
    """A port at which a client disconnects, and another connects and writes, between two reads of the port."""

    deeds: ClassVar[list[Callable[[], object]]] = []

    def _read(self, whole: bool = False) -> bytes:
        while self.deeds:
            self.deeds.pop(0)()
        return super()._read(whole)


def test_a_client_that_leaves_while_bytes_are_read_is_not_glued_to_the_next(warnings: list[str], opened: Open) -> None:
    port = Slow(9600, warnings.append)
    client = opened(port.name)
    os.write(client, b"R 9")
    port.deeds[:] = [lambda: os.close(client), lambda: os.write(opened(port.name), b"0\r")]
    assert port.receive() == Arrival(left_before=True, data=b"R 90\r", is_doubtful=True)
    port.close()


class Overtaken(PtyPort):
    """A port whose next client writes exactly when the bytes of the last one are read."""

    next_client = -1

    def _read(self, whole: bool = False) -> bytes:
        if whole and self.next_client < 0:
            self.next_client = os.open(self.name, os.O_RDWR | os.O_NOCTTY)
            os.write(self.next_client, b"H\r")
        return super()._read(whole)


def test_of_doubtful_bytes_every_line_is_refused_that_does_more_than_read() -> None:
    assert spoiled(b"R 90\rR 1\r") == b"\x18R 90\r\x18R 1\r"
    assert spoiled(b"S 20\r\rR 9") == b"\x18S 20\r\r\x18R 9"
    assert spoiled(b"\x18\rH\rL\r") == b"\x18\x18\rH\rL\r"  # the first bytes of a client that resynchronizes


def test_a_client_that_writes_while_another_leaves_is_not_taken_for_it(warnings: list[str], opened: Open) -> None:
    port = Overtaken(9600, warnings.append)
    client = opened(port.name)
    port.receive()
    os.close(client)
    assert port.receive() == Arrival(left_before=True, data=b"H\r")
    port.send(b"H 0.0\r")
    assert read_now(port.next_client) == b"H 0.0\r"
    os.close(port.next_client)
    port.close()


def test_a_reply_to_a_client_that_has_gone_is_not_kept_for_the_next(port: PtyPort, opened: Open) -> None:
    client = opened(port.name)
    port.receive()
    port.send(b"H 1.0\r")
    os.close(client)
    port.receive()
    port.send(b"H 2.0\r")
    assert read_now(opened(port.name)) == b""


def test_an_unread_client_blocks_nothing_and_is_spoken_of_once(
    unpaced_port: PtyPort, opened: Open, warnings: list[str]
) -> None:
    client = opened(unpaced_port.name)
    unpaced_port.receive()
    line = b"ERR 1 unknown command\r"
    for _ in range((PTY_BYTES + LIMIT_BYTES) // len(line) + 1000):
        unpaced_port.send(line)
    assert [words for words in warnings if "does not read" in words] == warnings
    assert len(warnings) == 1
    received = b""
    while data := read_now(client):
        received += data
        unpaced_port.flush()
    assert received == line * received.count(b"\r")
    unpaced_port.send(b"H 0.0\r")
    assert read_now(client) == b"H 0.0\r"
    os.close(client)
    unpaced_port.receive()
    assert "bytes of replies were dropped" in warnings[1]


def test_the_device_starts_at_the_tables_rate(warnings: list[str], opened: Open) -> None:
    port = PtyPort(19200, warnings.append)
    client = opened(port.name)
    assert termios.tcgetattr(client)[4:6] == [termios.B19200, termios.B19200]
    os.write(client, b"H\r")
    assert port.receive().data == b"H\r"
    assert warnings == []
    port.close()


def test_a_rate_without_a_name_of_its_own_can_be_the_tables(warnings: list[str]) -> None:
    port = PtyPort(12345, warnings.append)
    with serial.Serial(port.name, 12345) as client:
        client.write(b"H\r")
        assert port.receive().data == b"H\r"
        assert warnings == []
    port.close()


@pytest.mark.parametrize("baud", [4800, 19200, 115200, 12345])
def test_a_client_at_another_rate_gets_garbage_both_ways_and_is_told_of_once(
    port: PtyPort, warnings: list[str], baud: int
) -> None:
    with serial.Serial(port.name, baud, timeout=0) as client:
        for _ in range(2):
            client.write(b"P 90\r")
            assert port.receive().data != b"P 90\r"
        port.send(b"H 90.0\r")
        assert client.read(100) != b"H 90.0\r"
    assert len(warnings) == 1
    assert f"{baud} baud" in warnings[0]
    assert "9600" in warnings[0]


def test_a_client_that_corrects_its_rate_is_understood(port: PtyPort) -> None:
    with serial.Serial(port.name, 4800, timeout=0) as client:
        client.write(b"H\r")
        assert port.receive().data != b"H\r"
        client.baudrate = 9600
        client.write(b"H\r")
        assert port.receive().data == b"H\r"
        port.send(b"H 0.0\r")
        assert client.read(100) == b"H 0.0\r"


def test_without_pacing_any_rate_will_do(unpaced_port: PtyPort, warnings: list[str]) -> None:
    with serial.Serial(unpaced_port.name, 300, timeout=0) as client:
        client.write(b"H\r")
        assert unpaced_port.receive().data == b"H\r"
    assert warnings == []


def test_the_next_client_finds_the_device_as_the_first_one_did(port: PtyPort, opened: Open) -> None:
    client = opened(port.name)
    before = termios.tcgetattr(client)
    changed = list(before)
    changed[0] |= termios.ICRNL
    changed[3] |= termios.ECHO | termios.ICANON
    changed[4] = changed[5] = termios.B300
    termios.tcsetattr(client, termios.TCSANOW, changed)
    os.close(client)
    port.receive()
    assert termios.tcgetattr(opened(port.name)) == before


def test_a_lock_that_a_client_left_behind_is_undone(port: PtyPort, opened: Open) -> None:
    client = opened(port.name)
    fcntl.ioctl(client, termios.TIOCEXCL)
    os.close(client)
    port.receive()
    is_locked = fcntl.ioctl(opened(port.name), TIOCGEXCL, bytes(4))
    assert is_locked == bytes(4)


def test_all_that_a_client_wrote_before_it_left_arrives_with_its_leaving(port: PtyPort, opened: Open) -> None:
    client = opened(port.name)
    os.write(client, b"H\r" * 1500)
    assert port.receive() == Arrival(data=b"H\r" * (READ_BYTES // 2))
    os.close(client)
    assert port.receive() == Arrival(data=b"H\r" * (1500 - READ_BYTES // 2), left_after=True)
    assert port.receive() == Arrival()


def test_two_programs_at_once_are_warned_of(port: PtyPort, opened: Open, warnings: list[str]) -> None:
    first, second = opened(port.name), opened(port.name)
    port.receive()
    assert len(warnings) == 1
    assert "two programs" in warnings[0]
    os.close(first)
    assert port.receive() == Arrival()
    os.close(second)
    assert port.receive() == Arrival(left_after=True)


def test_parity_and_seven_bits_do_not_exist_on_a_pty(port: PtyPort) -> None:
    """The system drops them: the line stays 8N1 for one client after the other."""
    for _ in range(2):
        with serial.Serial(port.name, 9600, bytesize=serial.SEVENBITS, parity=serial.PARITY_EVEN) as client:
            client.write(b"\xc8\r")
            assert port.receive().data == b"\xc8\r"
        port.receive()


@pytest.mark.parametrize("flow_control", ["rtscts", "dsrdtr"])
def test_a_port_opens_with_flow_control_but_has_no_modem_lines(port: PtyPort, flow_control: str) -> None:
    rtscts, dsrdtr = flow_control == "rtscts", flow_control == "dsrdtr"
    with serial.Serial(port.name, 9600, timeout=0, rtscts=rtscts, dsrdtr=dsrdtr) as client:
        client.write(b"H\r")
        assert port.receive().data == b"H\r"
        with pytest.raises(OSError, match="Inappropriate ioctl"):
            _ = client.cts


def test_ports_are_many_and_apart(warnings: list[str]) -> None:
    ports = [PtyPort(9600, warnings.append) for _ in range(8)]
    assert len({port.name for port in ports}) == 8
    for port in ports:
        port.close()


def test_a_port_comes_back_without_its_link_when_the_links_place_is_taken(
    port: PtyPort, warnings: list[str], tmp_path: Path, opened: Open
) -> None:
    path = tmp_path / "table"
    port.link = DeviceLink(path, port.name)
    port.hang_up()
    path.unlink()
    path.write_text("three years of work")
    port.come_back()
    assert not path.is_symlink()
    assert path.read_text() == "three years of work"
    assert any(str(path) in sentence for sentence in warnings)
    client = opened(port.name)
    os.write(client, b"H\r")
    assert port.receive().data == b"H\r"
