"""The server loop of the table, with a simulated wall clock and scripted clients."""

import os
import socket
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from emulator.config.table_config import load_config
from emulator.ports.port import Arrival
from emulator.server.clock import Clock
from emulator.server.control_socket import ControlSocket
from emulator.server.server import Server
from emulator.server.signals import SignalWatch
from emulator.table.table import Table

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="select knows only sockets there")


class Wall:
    """A wall clock that is set by hand."""

    def __init__(self) -> None:
        self.now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


class ToldPort:
    """A port whose clients make one action after another, each when the server reads."""

    name = "told"
    client_count = 1
    output_descriptors: tuple[int, ...] = ()

    def __init__(self) -> None:
        self._reader, self._writer = os.pipe()
        os.write(self._writer, b"!")  # there is always something to read
        self.input_descriptors: tuple[int, ...] = (self._reader,)
        self.arrivals: list[Callable[[], Arrival]] = []
        self.sent = b""

    def receive(self) -> Arrival:
        return self.arrivals.pop(0)()

    def send(self, data: bytes) -> None:
        self.sent += data

    def flush(self) -> None: ...

    def hang_up(self) -> None: ...

    def come_back(self) -> None: ...

    def close(self) -> None:
        os.close(self._reader)
        os.close(self._writer)


@pytest.fixture
def wall() -> Wall:
    return Wall()


@pytest.fixture
def port() -> Iterator[ToldPort]:
    port = ToldPort()
    yield port
    port.close()


@pytest.fixture
def table() -> Table:
    return Table(load_config())


@pytest.fixture
def server(table: Table, wall: Wall) -> Iterator[Server]:
    """A server without ports, whose warnings are failures."""
    with SignalWatch("SIGTERM") as signals:
        yield Server(table, Clock(1000, wall_s=wall), [], signals, None, pytest.fail)


def test_a_burst_of_triggers_does_not_hasten_time(server: Server, table: Table, wall: Wall) -> None:
    wall.now_s += 0.0005
    for _ in range(100):
        server.trigger()
    assert table.tick == 1


def test_a_trigger_latches_where_the_table_is_at_that_instant(server: Server, table: Table, wall: Wall) -> None:
    table.receive(b"P 10\r")
    table.advance(500)
    wall.now_s += 0.5005
    server.trigger()
    assert table.tick == 501
    assert abs(table.status().latched_deg - table.status().encoder_deg) < 0.02
    assert table.status().latched_deg > 0.5


def test_a_client_that_comes_after_a_reset_is_not_taken_for_the_one_that_left(
    table: Table, wall: Wall, port: ToldPort
) -> None:
    def leave_in_mid_line() -> Arrival:
        return Arrival(data=b"P 9", left_after=True)

    def ask() -> Arrival:
        wall.now_s += 0.1  # for the bytes to be transmitted
        return Arrival(data=b"H\r")

    def end() -> Arrival:
        running.quit()
        return Arrival()

    port.arrivals = [leave_in_mid_line, ask, end]
    with (
        tempfile.TemporaryDirectory(prefix="table-") as folder,
        SignalWatch("SIGTERM") as signals,
        ExitStack() as stack,
    ):
        control = ControlSocket(Path(folder) / "control")
        stack.callback(control.close)
        client = stack.enter_context(socket.socket(socket.AF_UNIX))
        client.connect(str(control.path))
        client.sendall(b'{"command": "reset"}\n')
        running = Server(table, Clock(1000, wall_s=wall), [port], signals, control, pytest.fail)
        running.run()
    assert port.sent == b"H 0.0\r"


@pytest.mark.parametrize("moving", [False, True])
@pytest.mark.parametrize("time_scale", [1.0, 10.0])
@pytest.mark.parametrize(("pause_s", "missing_s"), [(0.4, 0.0), (0.6, 0.6), (3600.0, 3600.0)])
def test_a_stop_of_more_than_half_a_second_is_left_out_at_rest_and_in_motion_alike(
    table: Table, wall: Wall, port: ToldPort, *, moving: bool, time_scale: float, pause_s: float, missing_s: float
) -> None:
    """The clock of a stopped process (SIGSTOP) continues; the table catches up completely or not at all."""
    said: list[str] = []
    clock = Clock(1000, time_scale, wall_s=wall)
    if moving:
        table.receive(b"S 40\rR 4000\r")
    ticks: list[int] = []

    def pause() -> Arrival:
        ticks.append(table.tick)
        wall.now_s += pause_s
        return Arrival()

    def look() -> Arrival:
        ticks.append(table.tick)
        return Arrival()

    def end() -> Arrival:
        running.quit()
        return Arrival()

    port.arrivals = [pause, *([look] * 20), end]
    with SignalWatch("SIGTERM") as signals:
        running = Server(table, clock, [port], signals, None, said.append)
        running.run()
    made_up_s = (ticks[-1] - ticks[0]) / 1000 / time_scale
    assert made_up_s == pytest.approx(pause_s - missing_s, abs=0.002)
    assert bool(missing_s) == bool(said)
