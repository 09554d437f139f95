import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from emulator.server.control_socket import ControlSocket
from tests.emulator.fault_bench import Bench
from tests.emulator.quiet_stand import QuietStand

PATIENCE_S = 20.0
"""Timeout for what should come at once; only a failing test reaches it."""


class EmulatorProcess:
    """A running `python -m emulator`. It is ended after its test, and must end without an error."""

    def __init__(self, arguments: tuple[str, ...], stderr_path: Path) -> None:
        self._stderr_path = stderr_path
        with stderr_path.open("wb") as stderr:
            self.process = subprocess.Popen(
                [sys.executable, "-m", "emulator", *arguments], stdout=subprocess.PIPE, stderr=stderr, text=True
            )
        self.port = self.next_line()

    def next_line(self) -> str:
        assert self.process.stdout is not None
        return self.process.stdout.readline().rstrip("\n")

    @property
    def stderr(self) -> str:
        return self._stderr_path.read_text()

    def wait_for_words(self, words: str) -> None:
        wait_until(lambda: words in self.stderr)

    def stop(self) -> int:
        """End the emulator as a service manager would and return its exit status."""
        self.process.terminate()
        status = self.process.wait(PATIENCE_S)
        assert self.process.stdout is not None
        self.process.stdout.close()
        return status


def wait_until(condition: Callable[[], bool]) -> None:
    end_s = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < end_s, "what should have come did not"
        time.sleep(0.005)


@pytest.fixture
def start_emulator(tmp_path: Path) -> Iterator[Callable[..., EmulatorProcess]]:
    """Start emulators with the given arguments."""
    started: list[EmulatorProcess] = []

    def start(*arguments: str) -> EmulatorProcess:
        started.append(EmulatorProcess(arguments, tmp_path / f"stderr{len(started)}"))
        return started[-1]

    yield start
    for one in started:
        assert one.stop() == 0, one.stderr


@pytest.fixture(name="wait_until")
def _wait_until() -> Callable[[Callable[[], bool]], None]:
    return wait_until


@pytest.fixture
def warnings() -> list[str]:
    """The warnings of a port to the user of the emulator; its `append` is the port's `warn`."""
    return []


@pytest.fixture
def opened() -> Iterator[Callable[[str], int]]:
    """Open devices as any program would, and close those that are still open afterwards."""
    descriptors: list[int] = []

    def open_device(name: str) -> int:
        descriptors.append(os.open(name, os.O_RDWR | os.O_NOCTTY))
        return descriptors[-1]

    yield open_device
    for descriptor in descriptors:
        try:
            os.close(descriptor)
        except OSError:
            continue


@pytest.fixture
def bench() -> Bench:
    """A table for fault injection, with its port and its client."""
    return Bench()


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
    """The path of a control channel that is served until the end of the test."""
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
