"""The effect of faults on the edges at the trigger input."""

import math

from emulator.faults.fault import BouncedTrigger, MissedTrigger
from emulator.faults.schedule import FaultSchedule
from protocol.bench import Fault

TRIGGER_KINDS: frozenset[type[Fault]] = frozenset((MissedTrigger, BouncedTrigger))
"""The faults that this module implements."""


class TriggerFaults:
    """Removes and adds edges, as the active faults require."""

    def __init__(self, tick_hz: int, faults: FaultSchedule) -> None:
        """Start with an input without bounce."""
        self._faults = faults
        self._tick_hz = tick_hz
        self._bounce_end_tick = 0

    def misses_edge(self) -> bool:
        """Return whether the controller misses this edge."""
        fault = self._faults.holding(MissedTrigger)
        return fault is not None and self._faults.strikes(fault.probability)

    def bounces(self, tick: int) -> list[tuple[int, float]]:
        """Return the additional edges of this tick after an edge, each a tick and a fraction. They do not bounce."""
        fault = self._faults.holding(BouncedTrigger)
        if fault is None or tick < self._bounce_end_tick:
            return []
        span_ticks = fault.within_s * self._tick_hz
        self._bounce_end_tick = tick + math.ceil(span_ticks) + 1
        times = [tick + self._faults.chance.random() * span_ticks for _ in range(fault.edges)]
        return [(math.floor(time), time - math.floor(time)) for time in times]
