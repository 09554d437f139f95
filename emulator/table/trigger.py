"""The trigger input, at which the laser probe makes the controller latch the table's position.

An edge may occur at any instant: its time is a tick and a fraction of it.
"""

import math
from heapq import heappop, heappush

from emulator.faults.schedule import FaultSchedule
from emulator.faults.trigger_faults import TriggerFaults


class TriggerInput:
    """The scheduled edges: single ones, and a periodic train."""

    def __init__(self, tick_hz: int, faults: FaultSchedule) -> None:
        """Start with an input without edges."""
        self._tick_hz = tick_hz
        self._faults = TriggerFaults(tick_hz, faults)
        self._rate_hz = 0.0
        self._origin_tick = 0
        self._periods = 0
        self._single: list[tuple[int, float]] = []

    @property
    def rate_hz(self) -> float:
        """The rate of the periodic train; 0 without a train."""
        return self._rate_hz

    def start_train(self, rate_hz: float, tick: int) -> None:
        """Start a periodic train whose first edge occurs one period after `tick`; a rate of 0 ends it.

        Raises:
            ValueError: the rate is negative, or exceeds one edge per tick.
        """
        if not 0.0 <= rate_hz <= self._tick_hz:
            raise ValueError(f"a trigger rate of {rate_hz} Hz is outside 0..{self._tick_hz} Hz")
        self._rate_hz, self._origin_tick, self._periods = rate_hz, tick, 1

    def add_edge(self, tick: int, fraction: float) -> None:
        """Add a single edge, at a fraction (0..1) of the tick that starts at `tick`."""
        heappush(self._single, (tick, fraction))

    @property
    def next_tick(self) -> int | None:
        """The tick of the next edge; None if no edge is scheduled."""
        edge = min(self._upcoming(), default=None)
        return None if edge is None else edge[0]

    def take(self, tick: int) -> float | None:
        """Remove the next edge if it occurs before the end of the tick that starts at `tick`; return its fraction."""
        upcoming = self._upcoming()
        if not upcoming:
            return None
        edge = min(upcoming)
        if edge[0] > tick:
            return None
        if self._single and edge == self._single[0]:
            heappop(self._single)
        else:
            self._periods += 1
        return edge[1]

    def sees_edge(self, tick: int) -> bool:
        """Return whether the controller detects an edge in this tick. If a fault makes it bounce, others follow it."""
        if self._faults.misses_edge():
            return False
        for edge in self._faults.bounces(tick):
            self.add_edge(*edge)
        return True

    def _upcoming(self) -> list[tuple[int, float]]:
        edges = self._single[:1]
        if self._rate_hz:
            offset = self._periods * self._tick_hz / self._rate_hz
            if math.isfinite(offset):
                edges.append((self._origin_tick + math.floor(offset), offset - math.floor(offset)))
        return edges
