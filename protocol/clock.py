"""The time that a client waits by. This file alone reads the wall clock."""

import time
from typing import Protocol


class Clock(Protocol):
    """A source of time, real or simulated."""

    def now_s(self) -> float:
        """Return the time since an arbitrary but fixed moment."""
        ...

    def sleep_s(self, duration_s: float) -> None:
        """Return when `duration_s` has passed."""
        ...


class WallClock:
    """Real time, untouched by changes of the date."""

    def now_s(self) -> float:
        """Return the time since an arbitrary but fixed moment."""
        return time.monotonic()

    def sleep_s(self, duration_s: float) -> None:
        """Return when `duration_s` has passed."""
        time.sleep(duration_s)


def clock_of(port: object) -> Clock:
    """Return the clock that `port` carries as `port.clock`, else the wall clock.

    A port onto a simulated table lives in simulated time; a device of the operating system carries no clock.
    """
    clock: Clock | None = getattr(port, "clock", None)
    return WallClock() if clock is None else clock
