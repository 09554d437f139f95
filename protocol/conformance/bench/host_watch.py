"""Measure scheduling delays of the machine that runs the tests, so that a busy machine does not fail a table.

A busy machine runs programs late, and its kernel may hold back the bytes of a serial line for more than a second. Then
a reply is missing that the table sent in time, and the line shows no difference. The watch therefore has its own line:
a pseudo-terminal without a table. It sends a beat through that line all the time.
"""

import os
import select
import threading
import time
from contextlib import AbstractContextManager, nullcontext
from typing import Protocol, Self

_PERIOD_S = 0.01
_LOOK_S = 0.1
_CALM_S = 1.0
"""A machine without delays for this time is calm again."""


class Watch(Protocol):
    """Data of the machine that a session runs on."""

    def restart(self) -> None:
        """Reset the maximum delay."""
        ...

    def late_s(self) -> float:
        """Return the maximum delay since `restart`."""
        ...

    def lap_s(self) -> float:
        """Return the maximum delay since the last call."""
        ...

    def wait_for_calm(self, allowed_s: float, patience_s: float) -> None:
        """Return when no delay has exceeded `allowed_s` for a while, or when the patience is over."""
        ...


class Punctual:
    """The watch in simulated time, which has no delays."""

    def restart(self) -> None:
        """Do nothing."""

    def late_s(self) -> float:
        """Return 0."""
        return 0.0

    def lap_s(self) -> float:
        """Return 0."""
        return 0.0

    def wait_for_calm(self, allowed_s: float, patience_s: float) -> None:
        """Return at once."""


class HostWatch:
    """Sends a beat through a pseudo-terminal every 10 ms, from a thread, during a `with` block.

    The delay of a beat is the time from when it was due until it is received.
    """

    def __init__(self) -> None:
        self._worst_s = self._worst_of_lap_s = 0.0
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, name="host watch", daemon=True)

    def __enter__(self) -> Self:
        self._receiver, self._sender = os.openpty()
        self._due_s = time.monotonic()
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()
        os.close(self._sender)
        os.close(self._receiver)

    def restart(self) -> None:
        """Reset the maximum delay."""
        self._worst_s = 0.0

    def late_s(self) -> float:
        """Return the maximum delay since `restart`, including the beat under way."""
        return max(self._worst_s, time.monotonic() - self._due_s)

    def lap_s(self) -> float:
        """Return the maximum delay since the last call, including the beat under way."""
        worst_s, self._worst_of_lap_s = self._worst_of_lap_s, 0.0
        return max(worst_s, time.monotonic() - self._due_s)

    def wait_for_calm(self, allowed_s: float, patience_s: float) -> None:
        """Return when no delay has exceeded `allowed_s` for a second, or when the patience is over."""
        deadline_s = time.monotonic() + patience_s
        calm_since_s = time.monotonic()
        while time.monotonic() < min(deadline_s, calm_since_s + _CALM_S):
            self.restart()
            time.sleep(_LOOK_S)
            if self.late_s() > allowed_s:
                calm_since_s = time.monotonic()

    def _run(self) -> None:
        while not self._ended.wait(max(0.0, self._due_s - time.monotonic())):
            os.write(self._sender, b".")
            while not select.select([self._receiver], [], [], _LOOK_S)[0]:
                if self._ended.is_set():
                    return
            os.read(self._receiver, 1)
            back_s = time.monotonic()
            self._worst_s = max(self._worst_s, back_s - self._due_s)
            self._worst_of_lap_s = max(self._worst_of_lap_s, back_s - self._due_s)
            self._due_s = back_s + _PERIOD_S


def watch_in(simulated: bool) -> AbstractContextManager[Watch]:
    """Return the watch for simulated or real time.

    Without pseudo-terminals, as on Windows, the machine is assumed to have no delays.
    """
    return HostWatch() if not simulated and hasattr(os, "openpty") else nullcontext(Punctual())
