"""The trigger input, on which the laser probe tells the controller to latch the table's position.

An edge may come at any instant: its time is a tick and a fraction of it.
"""

import math
from heapq import heappop, heappush

from emulator.faults.schedule import FaultSchedule
from emulator.faults.trigger_faults import TriggerFaults


class TriggerInput:
    """The edges to come: single ones, and a periodic train."""

    def __init__(self, tick_hz: int, faults: FaultSchedule) -> None:
        """Start with a silent input."""
        self._tick_hz = tick_hz
        self._faults = TriggerFaults(tick_hz, faults)
        self._rate_hz = 0.0
        self._origin_tick = 0
        self._periods = 0
        self._single: list[tuple[int, float]] = []

    @property
    def rate_hz(self) -> float:
        """The rate of the periodic train; 0 where there is none."""
        return self._rate_hz

    def start_train(self, rate_hz: float, tick: int) -> None:
        """Begin a periodic train whose first edge comes one period after `tick`; a rate of 0 ends it.

        Raises:
            ValueError: The rate is negative, or beyond one edge a tick.
        """
        if not 0.0 <= rate_hz <= self._tick_hz:
            raise ValueError(f"a trigger rate of {rate_hz} Hz is outside 0..{self._tick_hz} Hz")
        self._rate_hz, self._origin_tick, self._periods = rate_hz, tick, 1

    def add_edge(self, tick: int, fraction: float) -> None:
        """Add a single edge, at a fraction (0..1) of the tick that begins at `tick`."""
        heappush(self._single, (tick, fraction))

    @property
    def next_tick(self) -> int | None:
        """The tick in which the next edge comes; None where no edge is to come."""
        edge = min(self._upcoming(), default=None)
        return None if edge is None else edge[0]

    def take(self, tick: int) -> float | None:
        """Take the next edge if it comes before the end of the tick that begins at `tick`; return its fraction."""
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
        """Return whether the controller sees an edge in this tick; where a fault makes it bounce, others follow it."""
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
