import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from protocol.program.ending import ended


def interrupted() -> int:
    raise KeyboardInterrupt


def failing() -> int:
    raise ValueError("table.toml: is wrong")


def without_room() -> int:
    raise OSError(28, "No space left on device")


@pytest.mark.parametrize(
    ("work", "status", "said"),
    [
        (lambda: 0, 0, ""),
        (lambda: 1, 1, ""),
        (interrupted, 130, "tool: interrupted\n"),
        (failing, 2, "tool: table.toml: is wrong\n"),
        (without_room, 2, "tool: [Errno 28] No space left on device\n"),
    ],
)
def test_a_command_ends_with_its_status_and_at_most_one_line(
    work: Callable[[], int], status: int, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert ended("tool", work, ValueError) == status
    assert capsys.readouterr().err == said


def test_an_error_that_was_not_expected_is_not_hidden() -> None:
    with pytest.raises(ValueError, match="is wrong"):
        ended("tool", failing)


PRINTING = (
    "import sys; from protocol.program.ending import ended; sys.exit(ended('tool', lambda: print('x' * 100_000) or 0))"
)


def test_a_reader_that_has_gone_is_one_line_and_status_2() -> None:
    with subprocess.Popen(
        [sys.executable, "-c", PRINTING], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        process.stdout.close()
        assert process.stderr is not None
        assert process.stderr.read() == "tool: stdout is closed\n"
    assert process.returncode == 2


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no device without room")
def test_results_for_which_there_is_no_room_are_one_line_and_status_2() -> None:
    with Path("/dev/full").open("w", encoding="ascii") as full:
        done = subprocess.run(
            [sys.executable, "-c", PRINTING], check=False, stdout=full, stderr=subprocess.PIPE, text=True
        )
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1


INTERRUPTED_RUN = """
import os, signal, sys, threading
from emulator.config.table_config import load_config
from protocol.program.ending import ended
from tools.emulated import Motion, emulate

config = load_config()
motions = [Motion(0.1, 1000.0, 10.0, 100.0)]
emulate(config, motions, 0.2)  # compiled now

def work():
    threading.Timer(0.1, os.kill, (os.getpid(), signal.SIGINT)).start()
    for _ in range(600):
        emulate(config, motions, 200.0)
    return 0

sys.exit(ended("tool", work))
"""


@pytest.mark.skipif(sys.platform == "win32", reason="there a process cannot interrupt itself so")
def test_an_interrupt_in_a_compiled_run_ends_the_command_and_does_not_crash_it() -> None:
    done = subprocess.run(
        [sys.executable, "-c", INTERRUPTED_RUN], check=False, capture_output=True, text=True, timeout=120.0
    )

    assert (done.returncode, done.stderr) == (130, "tool: interrupted\n")
