"""Convert wall time to simulated ticks. Only this file of the package reads the wall clock."""

import time
from collections.abc import Callable

from emulator.faults.parameter import Parameter

TIME_SCALE = Parameter("time_scale", 1e-3, 1e6, "time scale: simulated time over real time")


class Clock:
    """A wall clock that counts simulated ticks at a rate that can be changed at run time.

    The count starts at 0 and has no jumps: a new time scale applies from the present instant.

    Args:
        tick_hz: ticks per simulated second.
        time_scale: simulated seconds per wall second, within `TIME_SCALE`.
        wall_s: source of monotonic wall time in seconds.
    """

    def __init__(self, tick_hz: int, time_scale: float = 1.0, wall_s: Callable[[], float] = time.monotonic) -> None:
        self._tick_hz = tick_hz
        self.wall_s = wall_s
        self._time_scale = time_scale
        self._origin_s = wall_s()
        self._origin_ticks = 0.0

    @property
    def time_scale(self) -> float:
        """Simulated seconds per wall second."""
        return self._time_scale

    @property
    def ticks_per_wall_s(self) -> float:
        """Ticks per wall second at the present time scale."""
        return self._tick_hz * self._time_scale

    def now_ticks(self) -> float:
        """Return the present instant in ticks, including the fraction."""
        return self._origin_ticks + (self.wall_s() - self._origin_s) * self.ticks_per_wall_s

    def wall_s_until(self, tick: float) -> float:
        """Return the wall time in seconds until the given tick; 0 if it has passed."""
        return max(0.0, (tick - self.now_ticks()) / self.ticks_per_wall_s)

    def set_time_scale(self, time_scale: float) -> None:
        """Continue from the present instant with another rate."""
        if not TIME_SCALE.accepts(time_scale):
            raise ValueError(f"the time scale must be {TIME_SCALE.allowed}, not {time_scale}")
        self.set_ticks(self.now_ticks())
        self._time_scale = time_scale

    def set_ticks(self, ticks: float) -> None:
        """Set the count of the present instant: after an overload, or a power cycle."""
        self._origin_s = self.wall_s()
        self._origin_ticks = ticks
