"""The command line that controls a running emulator."""

import json
import sys
from pathlib import Path

import pytest

from emulator.control_client import main
from emulator.server.control_commands import COMMANDS
from tests.emulator.quiet_stand import QuietStand

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Unix sockets")


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


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_is_on_the_command_line(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["path", name, "--help"])
    assert ended.value.code == 0
    assert COMMANDS[name].help in capsys.readouterr().out
