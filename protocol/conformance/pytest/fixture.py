"""The value of the fixture `rotary_table` in a test."""

import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path
from types import TracebackType
from typing import Self

import pytest

from protocol.bench import BenchError
from protocol.client import TableClient
from protocol.conformance.bench.ports import SessionError, open_port
from protocol.conformance.bench.stand import POWER_CYCLE, TRIGGER, Stand, stand_beside
from protocol.conformance.bench.wire import ReopenablePort
from protocol.conformance.profile.profile import Profile, ProfileError, load_profile
from protocol.errors import TableError
from protocol.program.own_program import own_environment, own_program

PTY = "pty"
"""Given instead of a port's URL: a new emulator on a pseudo-terminal."""
_START_S = 20.0


class RotaryTable:
    """A rotary table for one test.

    Attributes:
        url: opens the table. A table in the same process has only `port`: each opening of `emulator://` is another
            table.
        control: the control channel of an emulator in another process, if there is one.
        profile: properties of the table.
    """

    def __init__(self, url: str, control: Path | None, profile: Path | None) -> None:
        self.url = url
        try:
            self.profile: Profile = load_profile(profile)
        except ProfileError as error:
            pytest.fail(str(error), pytrace=False)
        self.control = control
        self._opened = False

    @cached_property
    def port(self) -> ReopenablePort:
        """The open port. It is opened at the first use and closed after the test."""
        try:
            port = open_port(self.url, self.profile)
        except SessionError as error:
            pytest.fail(str(error), pytrace=False)
        self._opened = True
        return port

    @cached_property
    def client(self) -> TableClient:
        """A client that uses the port."""
        serial, motion = self.profile.serial, self.profile.motion
        return TableClient(self.port, serial.timeout_s, serial.decimals, motion.acceleration_deg_s2)

    def trigger(self) -> None:
        """Apply one edge to the trigger input. Skip the test if the rig cannot do this."""
        self._do(TRIGGER, lambda stand: stand.trigger())

    def power_cycle(self) -> None:
        """Switch the table off and on. Skip the test if the rig cannot do this."""
        self._do(POWER_CYCLE, lambda stand: stand.power_cycle())

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """Stop the table, and close the port."""
        if not self._opened:
            return
        try:
            if not getattr(self.port, "is_open", True):
                self.port.open()  # a test may close the port while the table moves
            self.client.stop()
        except (TableError, OSError):
            pass  # a test may leave a table that does not reply
        finally:
            self.port.close()

    @cached_property
    def _stand(self) -> Stand:
        # A pty has only one client, so the rig must not open it.
        return stand_beside(self.port, self.control, self.profile)

    def _do(self, capability: str, deed: Callable[[Stand], None]) -> None:
        try:
            if capability not in self._stand.capabilities:
                pytest.skip(f"{capability} not available")
            deed(self._stand)
        except BenchError as error:
            pytest.fail(str(error), pytrace=False)


@contextmanager
def pty_emulator(folder: Path) -> Iterator[tuple[str, Path]]:
    """Run an emulator on a pseudo-terminal, and yield its device and its control channel."""
    control = folder / "control"
    command = own_program("emulator", "--pty", "--control", str(control))
    with subprocess.Popen(  # noqa: S603 - this very interpreter, with words of our own
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=own_environment()
    ) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        try:
            url = process.stdout.readline().strip()
            if not url:
                pytest.fail(f"the emulator did not start: {process.stderr.read().strip()}")
            yield url, control
        finally:
            process.terminate()
            process.wait(_START_S)
