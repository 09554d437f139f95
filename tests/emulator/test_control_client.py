"""The command line that talks to a running stand-in."""

import json
import socket
import sys
import threading
from pathlib import Path

import pytest

from emulator.control_client import main, request
from emulator.server.control_commands import COMMANDS
from protocol.bench import BenchError
from tests.emulator.quiet_stand import QuietStand

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Unix sockets")


def test_a_stand_in_that_takes_nobody_in_is_not_waited_for(folder: Path) -> None:
    with socket.socket(socket.AF_UNIX) as deaf, socket.socket(socket.AF_UNIX) as waiting:
        deaf.bind(str(folder / "control"))
        deaf.listen(0)
        waiting.connect(str(folder / "control"))
        with pytest.raises(BenchError):
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
        with pytest.raises(BenchError, match="no answer of a stand-in"):
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
    with pytest.raises(BenchError):
        request(folder / "none", "trigger")


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_is_on_the_command_line(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["path", name, "--help"])
    assert ended.value.code == 0
    assert COMMANDS[name].help in capsys.readouterr().out
