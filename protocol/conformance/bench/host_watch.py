"""Is the machine that tests punctual? A watch that keeps a busy machine from failing a table.

A busy machine wakes programs late, and its kernel may keep the bytes of a serial line to itself, for a second and more:
then a reply is missing that the table gave in time, and nothing on the wire tells one from the other. So the watch has
a line of its own, a pseudo-terminal with no table, and sends itself a beat through it all the time.
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
"""A machine that was punctual for this long is calm again."""


class Watch(Protocol):
    """What a session asks about the machine that it runs on."""

    def restart(self) -> None:
        """Forget how late the machine has been."""
        ...

    def late_s(self) -> float:
        """Return by how much the machine has been late at most since `restart`."""
        ...

    def lap_s(self) -> float:
        """Return by how much the machine has been late at most since the last call."""
        ...

    def wait_for_calm(self, allowed_s: float, patience_s: float) -> None:
        """Return when the machine has not been later than `allowed_s` for a while, or when patience ends."""
        ...


class Punctual:
    """The watch in simulated time, where nothing is late."""

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
    """Sends a beat through a pseudo-terminal every 10 ms, from a thread, for as long as a `with` block lasts.

    A beat is as late as it is back after it was due to be sent.
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
        """Forget how late the machine has been."""
        self._worst_s = 0.0

    def late_s(self) -> float:
        """Return by how much the machine has been late at most since `restart`, with the beat that is under way."""
        return max(self._worst_s, time.monotonic() - self._due_s)

    def lap_s(self) -> float:
        """Return by how much the machine has been late at most since the last call, with the beat under way."""
        worst_s, self._worst_of_lap_s = self._worst_of_lap_s, 0.0
        return max(worst_s, time.monotonic() - self._due_s)

    def wait_for_calm(self, allowed_s: float, patience_s: float) -> None:
        """Return when the machine has not been later than `allowed_s` for a second, or when patience ends."""
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
    """Return the watch for simulated time or real; without pseudo-terminals, as on Windows, a machine is trusted."""
    return HostWatch() if not simulated and hasattr(os, "openpty") else nullcontext(Punctual())
