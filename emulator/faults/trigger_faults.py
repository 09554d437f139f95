"""What faults do to the edges on the trigger input."""

import math

from emulator.faults.fault import BouncedTrigger, MissedTrigger
from emulator.faults.schedule import FaultSchedule
from protocol.bench import Fault

TRIGGER_KINDS: frozenset[type[Fault]] = frozenset((MissedTrigger, BouncedTrigger))
"""The faults that this module gives their effect."""


class TriggerFaults:
    """Hides edges, and lets others follow them, as the faults that hold want it."""

    def __init__(self, tick_hz: int, faults: FaultSchedule) -> None:
        """Start with an input that does not bounce."""
        self._faults = faults
        self._tick_hz = tick_hz
        self._bounce_end_tick = 0

    def misses_edge(self) -> bool:
        """Return whether this edge is not seen."""
        fault = self._faults.holding(MissedTrigger)
        return fault is not None and self._faults.strikes(fault.probability)

    def bounces(self, tick: int) -> list[tuple[int, float]]:
        """Return the edges that follow one in this tick, each a tick and a fraction; they do not bounce themselves."""
        fault = self._faults.holding(BouncedTrigger)
        if fault is None or tick < self._bounce_end_tick:
            return []
        span_ticks = fault.within_s * self._tick_hz
        self._bounce_end_tick = tick + math.ceil(span_ticks) + 1
        times = [tick + self._faults.chance.random() * span_ticks for _ in range(fault.edges)]
        return [(math.floor(time), time - math.floor(time)) for time in times]
