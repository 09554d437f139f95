import json
import os
import socket
import stat
import sys
import tempfile
import threading
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from emulator.config import load_config
from emulator.control import COMMANDS, LONGEST_REQUEST, MOST_CLIENTS, ControlSocket, answer
from emulator.control_client import ControlError, main, request
from emulator.faults import Fault
from emulator.status import TableStatus
from emulator.table import Table

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Unix sockets")


class QuietStand:
    """A table that stands still, with a list of what was done to it."""

    def __init__(self) -> None:
        self.time_scale = 1.0
        self.done: list[object] = []
        self.table = Table(load_config())

    def trigger(self) -> None:
        self.done.append("trigger")

    def status(self) -> TableStatus:
        return self.table.status()

    def set_load_torque(self, torque_Nm: float) -> None:
        self.done.append(torque_Nm)

    def set_time_scale(self, time_scale: float) -> None:
        self.time_scale = time_scale

    def reset(self) -> None:
        self.done.append("reset")

    def preset(self, count: int) -> None:
        self.done.append(count)

    def inject(self, fault: Fault) -> None:
        self.done.append(fault.kind)

    def clear_faults(self) -> None:
        self.done.append("clear-faults")

    def quit(self) -> None:
        self.done.append("quit")


@pytest.fixture
def stand() -> QuietStand:
    return QuietStand()


@pytest.fixture
def folder() -> Iterator[Path]:
    """A folder with a name that is short enough for a socket's."""
    with tempfile.TemporaryDirectory(prefix="table-") as name:
        yield Path(name)


@pytest.fixture
def served(folder: Path, stand: QuietStand) -> Iterator[Path]:
    """The path of a control channel that is served until the test is over."""
    control = ControlSocket(folder / "control")
    ended = threading.Event()

    def serve() -> None:
        while not ended.wait(0.002):
            control.serve(stand)

    thread = threading.Thread(target=serve)
    thread.start()
    yield control.path
    ended.set()
    thread.join()
    control.close()


def test_each_command_does_what_it_says(stand: QuietStand) -> None:
    for name in ("trigger", "reset", "quit"):
        assert json.loads(answer(json.dumps({"command": name}).encode(), stand)) == {"ok": True}
    answer(b'{"command": "load-torque", "torque_Nm": -0.25}', stand)
    answer(b'{"command": "time-scale", "time_scale": 10}', stand)
    assert stand.done == ["trigger", "reset", "quit", -0.25]
    assert stand.time_scale == 10.0


def test_state_shows_all_that_the_table_shows(stand: QuietStand) -> None:
    reply = json.loads(answer(b'{"command": "state"}', stand))
    assert reply == {"ok": True, "time_scale": 1.0, **stand.status()._asdict()}


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (b"", "JSON"),
        (b"trigger", "JSON"),
        (b"\xff\xfe", "JSON"),
        (b"[" * 3000, "JSON"),
        (b"[]", "object"),
        (b"{}", "names its command"),
        (b'{"command": 1}', "names its command"),
        (b'{"command": "dance"}', "'dance' is no command; there are trigger"),
        (b'{"command": "trigger", "now": 1}', "takes no parameter"),
        (b'{"command": "load-torque"}', "takes torque_Nm"),
        (b'{"command": "load-torque", "torque_Nm": "1"}', "must be a number"),
        (b'{"command": "load-torque", "torque_Nm": true}', "must be a number"),
        (b'{"command": "load-torque", "torque_Nm": NaN}', "must be a number"),
        (b'{"command": "load-torque", "torque_Nm": 1e400}', "must be a number"),
        (b'{"command": "time-scale", "time_scale": 0}', "from 0.001"),
        (b'{"command": "preset", "count": 0.5}', "count must be a whole number from -2147483648 to 2147483647"),
    ],
)
def test_a_bad_request_is_answered_with_a_sentence_and_changes_nothing(
    stand: QuietStand, line: bytes, words: str
) -> None:
    reply = json.loads(answer(line, stand))
    assert reply["ok"] is False
    assert words in reply["error"]
    assert stand.done == []


def test_the_socket_is_its_owners_only(folder: Path) -> None:
    control = ControlSocket(folder / "control")
    assert stat.S_IMODE(control.path.stat().st_mode) == 0o600
    control.close()
    assert not control.path.exists()


def test_the_mask_of_new_files_is_left_as_it_was(folder: Path) -> None:
    before = os.umask(0o022)
    ControlSocket(folder / "control").close()
    assert os.umask(before) == 0o022


def test_a_socket_that_a_dead_stand_in_left_is_replaced(folder: Path) -> None:
    path = folder / "control"
    with socket.socket(socket.AF_UNIX) as dead:
        dead.bind(str(path))
    ControlSocket(path).close()


def test_a_socket_that_is_served_is_left_alone(served: Path) -> None:
    with pytest.raises(OSError, match="another stand-in"):
        ControlSocket(served)
    assert request(served, "trigger") == {}


def test_an_ordinary_file_is_never_overwritten(folder: Path) -> None:
    path = folder / "thesis.tex"
    path.write_text("three years of work")
    with pytest.raises(OSError, match="in use"):
        ControlSocket(path)
    assert path.read_text() == "three years of work"


def test_requests_may_come_in_pieces_and_several_at_once(served: Path) -> None:
    with socket.socket(socket.AF_UNIX) as client, client.makefile("rb") as replies:
        client.settimeout(5.0)
        client.connect(str(served))
        client.sendall(b'{"command": "tri')
        client.sendall(b'gger"}\n{"command": "reset"}\nnonsense\n')
        assert [json.loads(replies.readline())["ok"] for _ in range(3)] == [True, True, False]


def test_a_request_without_end_is_cut_off(served: Path) -> None:
    with socket.socket(socket.AF_UNIX) as client, client.makefile("rb") as replies:
        client.settimeout(5.0)
        client.connect(str(served))
        client.sendall(b"x" * LONGEST_REQUEST)
        assert "at most" in json.loads(replies.readline())["error"]
        assert replies.readline() == b""


def test_clients_that_go_without_a_word_harm_nobody(served: Path) -> None:
    for _ in range(20):
        with socket.socket(socket.AF_UNIX) as client:
            client.connect(str(served))
            client.sendall(b'{"command": "state"}\n{"comm')
    assert request(served, "trigger") == {}


def test_a_crowd_of_clients_is_turned_away_and_those_who_were_there_are_served(folder: Path, stand: QuietStand) -> None:
    control = ControlSocket(folder / "control")
    with ExitStack() as stack:
        stack.callback(control.close)
        clients = [stack.enter_context(socket.socket(socket.AF_UNIX)) for _ in range(MOST_CLIENTS + 1)]
        for client in clients:
            client.settimeout(5.0)
            client.connect(str(control.path))
            control.serve(stand)
        assert b"too many" in clients[-1].recv(4096)
        assert clients[-1].recv(4096) == b""
        clients[0].sendall(b'{"command": "trigger"}\n')
        control.serve(stand)
        assert json.loads(clients[0].recv(4096)) == {"ok": True}
        clients[0].close()
        control.serve(stand)
        latecomer = stack.enter_context(socket.socket(socket.AF_UNIX))
        latecomer.connect(str(control.path))
        latecomer.sendall(b'{"command": "reset"}\n')
        control.serve(stand)
    assert stand.done == ["trigger", "reset"]


def test_a_stand_in_that_takes_nobody_in_is_not_waited_for(folder: Path) -> None:
    with socket.socket(socket.AF_UNIX) as deaf, socket.socket(socket.AF_UNIX) as waiting:
        deaf.bind(str(folder / "control"))
        deaf.listen(0)
        waiting.connect(str(folder / "control"))
        with pytest.raises(ControlError):
            request(folder / "control", "trigger")


@pytest.mark.parametrize("reply", [b"HTTP/1.1 400 Bad Request\n", b'{"ok": tr', b"[]\n", b"{}\n"])
def test_an_answer_of_something_else_is_said_to_be_none(folder: Path, reply: bytes) -> None:
    def answer_once() -> None:
        client, _ = listener.accept()
        with client:
            client.recv(4096)
            client.sendall(reply)

    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(str(folder / "control"))
        listener.listen()
        thread = threading.Thread(target=answer_once)
        thread.start()
        with pytest.raises(ControlError, match="no answer of a stand-in"):
            request(folder / "control", "trigger")
        thread.join()


def test_the_command_line_shows_the_state(served: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([str(served), "state"]) == 0
    assert json.loads(capsys.readouterr().out)["state"] == "idle"


def test_the_command_line_passes_numbers_on(served: Path, stand: QuietStand) -> None:
    assert main([str(served), "load-torque", "-0.5"]) == 0
    assert stand.done == [-0.5]


def test_the_command_line_says_why_a_request_is_refused(served: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([str(served), "time-scale", "-1"]) == 2
    assert "from 0.001" in capsys.readouterr().err


def test_nobody_there_is_one_line_that_says_what_to_do(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([str(folder / "none"), "trigger"]) == 2
    assert "--control" in capsys.readouterr().err
    with pytest.raises(ControlError):
        request(folder / "none", "trigger")


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_is_on_the_command_line(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["path", name, "--help"])
    assert ended.value.code == 0
    assert COMMANDS[name].help in capsys.readouterr().out
