"""The trigger line from the probe to robot and table, with a simulated probe.

Once started, a laser probe runs at its own rate. A table in simulated time receives the edges at their exact times,
between two ticks. An emulator in real time receives them over its control channel, when the host has time for it.
"""

from array import array
from collections.abc import Iterator
from itertools import count
from typing import NamedTuple, Protocol

import numpy as np

from planner.arrays import FloatArray
from protocol import Clock
from protocol.bench import GroundTruth, SimulatedBench, TableStatus


class TriggerFaults(NamedTuple):
    """Numbers of the triggers with faults.

    Attributes:
        table_misses: the table does not detect them.
        table_doubles: the table detects another edge after them, half a period later.
        robot_misses: the robot does not detect them.
        robot_doubles: the robot detects another edge after them, half a period later.
    """

    table_misses: frozenset[int] = frozenset()
    table_doubles: frozenset[int] = frozenset()
    robot_misses: frozenset[int] = frozenset()
    robot_doubles: frozenset[int] = frozenset()


class TableTruth(NamedTuple):
    """Ground truth that is not transmitted, `(n,)` each, by number of the trigger; NaN if there is none.

    The true angle of the table has the zero of its encoder: the middle of count 0, with the teeth in the middle of the
    backlash.

    Attributes:
        exposure_deg: true angle of the table when the profile was taken.
        edge_deg: the same when the edge of the trigger arrived at the table.
        shaft_deg: angle of the motor at that edge, divided by the gear ratio.
        latched_deg: encoder angle at that edge, without rounding.
    """

    exposure_deg: FloatArray
    edge_deg: FloatArray
    shaft_deg: FloatArray
    latched_deg: FloatArray


class TriggerLine(GroundTruth, Protocol):
    """The probe during a motion: a method `trigger`, and access to the ground truth of the table."""

    def times_s(self) -> FloatArray:
        """Return the times of the profiles so far, by the clock of the table's port."""
        ...

    def stop(self) -> None:
        """Stop the triggers."""
        ...

    def truth(self) -> TableTruth | None:
        """Return the true angles of the table at each trigger; None if the port does not provide them."""
        ...


class ProbeOnPort:
    """A probe that runs on its own, connected to the table of a port in simulated time."""

    def __init__(
        self,
        table: SimulatedBench,
        rate_hz: float,
        delay_s: float = 0.0,
        faults: TriggerFaults | None = None,
        seed: int = 0,
    ) -> None:
        """Connect a probe to a table.

        Args:
            table: the table of the port.
            rate_hz: profiles per second.
            delay_s: maximum delay of an edge; each has a random delay up to this value.
            faults: faults of the triggers.
            seed: random seed of the delays.
        """
        self._table = table
        self._tick_hz = float(table.facts.tick_hz)
        self._period_s, self._delay_s = 1.0 / rate_hz, delay_s
        self._faults = faults or TriggerFaults()
        self._rng = np.random.default_rng((seed, 5))
        self._start_s = self._end_s = float("inf")
        self._is_running = False
        self._first_tick = table.tick
        status = table.status()
        self._shaft_deg, self._gap_deg = array("d", [status.shaft_deg]), array("d", [status.gap_deg])
        self._edges_s: dict[int, float] = {}
        self._latched_deg: dict[int, float] = {}
        self._arriving: list[int] = []
        self._coming: Iterator[tuple[float, int | None]] = self._edges()
        self._next: tuple[float, int | None] = (np.inf, None)
        table.observer = self._after_tick

    def status(self) -> TableStatus:
        """Return the present state of the table."""
        return self._table.status()

    def trigger(self) -> None:
        """Start the probe; a running probe triggers on its own."""
        if not self._is_running:
            self._is_running = True
            self._start_s = self._table.tick / self._tick_hz
            self._next = next(self._coming)
            self._put_on_line(self._table.tick)

    def stop(self) -> None:
        """Stop the triggers, and disconnect from the table."""
        self._end_s = self._table.tick / self._tick_hz
        self._table.observer = None

    def times_s(self) -> FloatArray:
        """Return the times of the profiles so far, by the table's clock."""
        now_s = min(self._end_s, self._table.tick / self._tick_hz)
        if self._start_s >= now_s:
            return np.zeros(0)
        taken = np.ceil((now_s - self._start_s) / self._period_s)
        return self._start_s + self._period_s * np.arange(taken, dtype=np.float64)

    def truth(self) -> TableTruth:
        """Return the true angles of the table at each trigger."""
        times_s = self.times_s()
        ticks = self._first_tick + np.arange(len(self._shaft_deg))
        edges_s = np.array([self._edges_s.get(number, np.nan) for number in range(len(times_s))])
        latched_deg = np.array([self._latched_deg.get(number, np.nan) for number in range(len(times_s))])
        shaft_deg = np.asarray(self._shaft_deg)
        table_deg = shaft_deg - np.asarray(self._gap_deg)
        return TableTruth(
            exposure_deg=np.interp(times_s * self._tick_hz, ticks, table_deg),
            edge_deg=np.interp(edges_s * self._tick_hz, ticks, table_deg),
            shaft_deg=np.interp(edges_s * self._tick_hz, ticks, shaft_deg),
            latched_deg=latched_deg,
        )

    def _edges(self) -> Iterator[tuple[float, int | None]]:
        """Yield the edges that the table detects, with the number of their trigger if they have one."""
        for number in count():
            time_s = self._start_s + number * self._period_s
            delay_s = self._delay_s * self._rng.random()
            if number not in self._faults.table_misses:
                self._edges_s[number] = time_s + delay_s
                yield time_s + delay_s, number
            if number in self._faults.table_doubles:
                yield time_s + 0.5 * self._period_s, None

    def _after_tick(self, status: TableStatus, _heard: bytes, _said: bytes) -> None:
        self._shaft_deg.append(status.shaft_deg)
        self._gap_deg.append(status.gap_deg)
        for number in self._arriving:
            self._latched_deg[number] = status.latched_deg
        self._arriving.clear()
        self._put_on_line(status.tick)

    def _put_on_line(self, tick: int) -> None:
        """Apply the edges of the tick that starts now to the line."""
        while (at := self._next[0] * self._tick_hz - tick) < 1.0:
            self._table.trigger(max(0.0, at))
            if self._next[1] is not None:
                self._arriving.append(self._next[1])
            self._next = next(self._coming)


class ProbeByHand:
    """A probe that the host triggers, for an emulator in real time with access to its ground truth."""

    def __init__(self, view: GroundTruth, clock: Clock) -> None:
        """Store the access to the ground truth, and the clock of the table's port."""
        self._view, self._clock = view, clock
        self._fired_s: list[float] = []

    def status(self) -> TableStatus:
        """Return the present state of the table."""
        return self._view.status()

    def trigger(self) -> None:
        """Take a profile."""
        self._fired_s.append(self._clock.now_s())
        self._view.trigger()

    def stop(self) -> None:
        """Do nothing: the probe triggers only on request."""

    def times_s(self) -> FloatArray:
        """Return the times of the profiles so far, by the clock of the table's port."""
        return np.array(self._fired_s)

    def truth(self) -> None:
        """Return None: when a reading arrives, the table has moved on."""


def robot_latch_times_s(times_s: FloatArray, delay_s: float, faults: TriggerFaults, seed: int) -> FloatArray:
    """Return the times at which the robot latches, `(m,)` ascending.

    Args:
        times_s: `(n,)` times of the triggers.
        delay_s: maximum delay of an edge.
        faults: faults of the triggers.
        seed: random seed of the delays.
    """
    delays_s = delay_s * np.random.default_rng((seed, 6)).random(len(times_s))
    heard = [time_s + delays_s[k] for k, time_s in enumerate(times_s) if k not in faults.robot_misses]
    period_s = float(np.median(np.diff(times_s))) if len(times_s) > 1 else 0.0
    heard += [times_s[k] + 0.5 * period_s for k in faults.robot_doubles if k < len(times_s)]
    return np.array(sorted(heard))
