"""Where scan locations come from: a path that is known, or a program's lines on stdin or a loopback TCP port.

A source is read only as far as there is space in the window. So the pipe blocks a program that sends faster than the
table moves, and the memory stays constant.
"""

import os
import select
import socket
import sys
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Protocol

from planner.arrays import FloatArray
from planner.tracking.pose_lines import PoseLines, SourceError

STDIN = "-"
_TCP = "tcp://"
_LOOPBACK = ("127.0.0.1", "localhost")
_CHUNK = 4096


class PoseSource(Protocol):
    """A source of scan locations."""

    def take(self, room: int, wait_s: float = 0.0) -> list[FloatArray]:
        """Return up to `room` locations (4, 4), after waiting for the first at most `wait_s` of real time.

        Raises:
            SourceError: the line is not a location, or the source failed.
        """

    @property
    def has_ended(self) -> bool:
        """Whether all locations were taken."""


class PathSource:
    """A path that is known, revealed as far as there is room."""

    def __init__(self, T_WS: FloatArray) -> None:
        """Reveal locations (n, 4, 4)."""
        self._rest = deque(T_WS)

    @property
    def has_ended(self) -> bool:
        """Whether all locations were taken."""
        return not self._rest

    def take(self, room: int, wait_s: float = 0.0) -> list[FloatArray]:  # noqa: ARG002 - nothing to wait for
        """Return the next locations."""
        return [self._rest.popleft() for _ in range(min(room, len(self._rest)))]


class ProgramSource:
    """The lines that a program writes to a file descriptor."""

    def __init__(self, descriptor: int, name: str) -> None:
        """Read from an open descriptor; `name` is for messages."""
        self._descriptor, self._lines, self._is_open = descriptor, PoseLines(name), True
        self._fault: SourceError | None = None

    @property
    def has_ended(self) -> bool:
        """Whether all locations were taken, and the end marker came with nothing behind it."""
        return self._lines.has_ended and not self._lines.poses and self._fault is None

    def take(self, room: int, wait_s: float = 0.0) -> list[FloatArray]:
        """Return what has come, see `PoseSource`; what came before a fault comes first."""
        poses, until_s = self._lines.poses, time.monotonic() + wait_s
        while len(poses) < room and self._is_open and not self._lines.has_ended and self._fault is None:
            left_s = 0.0 if poses else max(0.0, until_s - time.monotonic())
            if not select.select([self._descriptor], [], [], left_s)[0]:
                break
            self._read()
        if self._fault is not None and not poses:
            raise self._fault
        return [poses.popleft() for _ in range(min(room, len(poses)))]

    def _read(self) -> None:
        try:
            data = os.read(self._descriptor, _CHUNK)
            if data:
                self._lines.feed(data)
            else:
                self._is_open = False
                self._lines.close()
        except OSError as error:
            self._fault = SourceError(f"poses: cannot be read ({error.strerror or error})")
        except SourceError as error:
            self._fault = error


def is_program(name: str) -> bool:
    """Return whether a text names a program's source."""
    return name == STDIN or name.startswith(_TCP)


@contextmanager
def program_source(name: str, say: Callable[[str], None], wait_s: float) -> Iterator[ProgramSource]:
    """Open a program's source: `-` for stdin, or tcp://127.0.0.1:PORT, where a program is to connect.

    Args:
        name: which one; port 0 picks a free port.
        say: called with a line that names the port.
        wait_s: how long to wait for the program.

    Raises:
        SourceError: it cannot be opened, or nobody connects.
    """
    if name == STDIN:
        yield ProgramSource(_stdin(), "stdin")
        return
    host, _, port = name.removeprefix(_TCP).rpartition(":")
    if host not in _LOOPBACK or not port.isdecimal() or int(port) > 65535:
        raise SourceError(f"poses: {name} is not allowed; allowed are - for stdin and {_TCP}127.0.0.1:PORT")
    try:
        server = socket.create_server((_LOOPBACK[0], int(port)))
    except OSError as error:
        raise SourceError(f"poses: {name} cannot be opened ({error.strerror or error}); take another port") from error
    with server:  # closed after the first program, so that a second one is refused
        server.settimeout(wait_s)
        say(f"waiting for poses at {_TCP}{_LOOPBACK[0]}:{server.getsockname()[1]}")
        try:
            client, _ = server.accept()
        except TimeoutError:
            raise SourceError(f"poses: no program connected within {wait_s:g} s") from None
    with client:
        yield ProgramSource(client.fileno(), name)


def _stdin() -> int:
    try:
        return sys.stdin.fileno()
    except (AttributeError, OSError, ValueError):  # a program may be started without it, or with it closed
        raise SourceError("poses: stdin is closed; connect a program to it, or use tcp://127.0.0.1:PORT") from None
