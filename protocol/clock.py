"""The clock that a client waits by. Only this file reads the wall clock."""

import time
from typing import Protocol


class Clock(Protocol):
    """A source of time, real or simulated."""

    def now_s(self) -> float:
        """Return the time since an arbitrary, fixed moment."""
        ...

    def sleep_s(self, duration_s: float) -> None:
        """Return after `duration_s`."""
        ...


class WallClock:
    """Real time, not affected by changes of the date."""

    def now_s(self) -> float:
        """Return the time since an arbitrary, fixed moment."""
        return time.monotonic()

    def sleep_s(self, duration_s: float) -> None:
        """Return after `duration_s`."""
        time.sleep(duration_s)


def clock_of(port: object) -> Clock:
    """Return the clock of `port` (its attribute `clock`) if it has one, else the wall clock.

    A port of a simulated table uses simulated time. A device of the operating system has no clock.
    """
    clock: Clock | None = getattr(port, "clock", None)
    return WallClock() if clock is None else clock
