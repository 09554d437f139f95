"""The bench of an emulator in another process: with the emulator's server, and with other listeners."""

import json
import socket
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from emulator.faults.fault import KINDS, Drop, HalfReply, Stall, fault_from, parameters_of
from emulator.server.control_commands import COMMANDS
from emulator.server.control_socket import ControlSocket
from protocol.bench import BenchError, Fault
from protocol.control_channel import ControlChannel, request
from tests.emulator.quiet_stand import QuietStand

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Unix sockets")

GOOD = {"ok": True, **QuietStand().table.status()._asdict()}


@pytest.fixture
def folder() -> Iterator[Path]:
    """A folder with a name that is short enough for a socket's."""
    with tempfile.TemporaryDirectory(prefix="table-") as name:
        yield Path(name)


@contextmanager
def serving(path: Path, stand: QuietStand) -> Iterator[ControlChannel]:
    """Serve a stand, and yield a channel to it."""
    control, ended = ControlSocket(path), threading.Event()

    def serve() -> None:
        while not ended.wait(0.001):
            control.serve(stand)

    thread = threading.Thread(target=serve)
    thread.start()
    try:
        yield ControlChannel(path)
    finally:
        ended.set()
        thread.join()
        control.close()


@contextmanager
def answering(path: Path, answer: Callable[[socket.socket], None]) -> Iterator[None]:
    """Let something that is not an emulator reply to the next client."""

    def serve() -> None:
        client, _ = listener.accept()
        with client:
            client.recv(4096)
            answer(client)

    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(str(path))
        listener.listen()
        thread = threading.Thread(target=serve)
        thread.start()
        yield
        thread.join()


def test_each_deed_reaches_the_table_or_its_server(folder: Path) -> None:
    stand = QuietStand()
    with serving(folder / "control", stand) as channel:
        channel.trigger()
        channel.reset()
        channel.reset(-7)
        channel.set_load_torque(0.25)
        channel.clear_faults()
        channel.set_time_scale(10.0)
        channel.quit()
        assert channel.status() == stand.table.status()
        assert channel.facts == stand.table.facts
    assert stand.done == ["trigger", "reset 0", "reset -7", 0.25, "clear-faults", "quit"]
    assert stand.time_scale == 10.0


def test_every_kind_of_fault_arrives_as_it_was_sent(folder: Path) -> None:
    faults: list[Fault] = [Drop(probability=0.5), Stall(at_s=2.0, for_s=1.5), HalfReply(bytes=3, at_command=4)]
    for kind in KINDS:
        numbers = {each.name: each.most for each in parameters_of(kind) if not each.name.startswith("at_")}
        faults.append(fault_from(kind, numbers))
    stand = QuietStand()
    with serving(folder / "control", stand) as channel:
        for fault in faults:
            channel.inject(fault)
    assert stand.done == faults


def test_a_refused_request_is_an_error_with_the_emulators_sentence(folder: Path) -> None:
    with serving(folder / "control", QuietStand()) as channel, pytest.raises(BenchError, match="must be a number from"):
        channel.set_load_torque(1e9)


@pytest.mark.parametrize("path", ["none", "x" * 300, "a\0b"])
def test_where_nobody_listens_no_channel_is_opened(path: str, folder: Path) -> None:
    with pytest.raises(BenchError, match="--control socket"):
        ControlChannel(folder / path)


def test_a_system_without_unix_sockets_has_no_channel(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr("socket.AF_UNIX")
    with pytest.raises(BenchError, match="this system has no Unix sockets"):
        ControlChannel(folder / "control")


@pytest.mark.parametrize(
    "reply",
    [
        b"HTTP/1.1 400 Bad Request\n",
        b'{"ok": tr',
        b"[" * 5000 + b"\n",
        b"[]\n",
        b"{}\n",
        b'{"ok": false}\n',
        b'{"ok": 1, "tick": 0}\n',
        b'{"ok": true}\n',
        b"\xff\xfe\n",
        *(json.dumps({**GOOD, name: None}).encode() + b"\n" for name in GOOD),
        *(json.dumps({**GOOD, name: "many"}).encode() + b"\n" for name in ("tick", "true_deg", "lost_bytes")),
        json.dumps({**GOOD, "state": 3}).encode() + b"\n",
        json.dumps({**GOOD, "tick": True}).encode() + b"\n",
    ],
)
def test_an_answer_of_something_else_is_never_taken_for_a_look_at_a_table(reply: bytes, folder: Path) -> None:
    with (
        answering(folder / "control", lambda client: client.sendall(reply)),
        pytest.raises(BenchError, match="not a reply of an emulator"),
    ):
        ControlChannel(folder / "control")


def test_an_emulator_that_takes_nobody_in_is_not_waited_for(folder: Path) -> None:
    with socket.socket(socket.AF_UNIX) as deaf, socket.socket(socket.AF_UNIX) as waiting:
        deaf.bind(str(folder / "control"))
        deaf.listen(0)
        waiting.connect(str(folder / "control"))
        with pytest.raises(BenchError):
            request(folder / "control", "trigger")


def test_a_listener_that_hangs_up_is_named(folder: Path) -> None:
    with (
        answering(folder / "control", lambda _: None),
        pytest.raises(BenchError, match="closed the connection without a reply"),
    ):
        request(folder / "control", "trigger")


def test_an_answer_that_comes_in_drops_is_given_up_as_one_that_does_not_come(folder: Path) -> None:
    ended = threading.Event()

    def drip(client: socket.socket) -> None:
        while not ended.wait(0.02):
            client.sendall(b" ")

    with answering(folder / "control", drip):
        with pytest.raises(BenchError, match="timed out"):
            request(folder / "control", "state", timeout_s=0.2)
        ended.set()


def test_every_verb_has_a_way_through_the_channel() -> None:
    said = {"trigger", "state", "facts", "load-torque", "time-scale", "preset", "clear-faults", "quit"}
    assert COMMANDS.keys() == said | {"reset"} | {f"fault-{kind}" for kind in KINDS}
