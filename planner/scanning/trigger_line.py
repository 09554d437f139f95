"""The line on which the probe tells robot and table that it takes a profile; the probe on it is simulated.

Once started, a laser probe runs at its own rate, whatever else goes on. The table behind a port in simulated time gets
its edges at their exact times, between two ticks. An emulator in real time gets them over its control channel,
when the host has time for it.
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
    """Numbers of the triggers that go wrong on the way.

    Attributes:
        table_misses: The table does not hear them.
        table_doubles: The table hears another edge after them, half a period later.
        robot_misses: The robot does not hear them.
        robot_doubles: The robot hears another edge after them, half a period later.
    """

    table_misses: frozenset[int] = frozenset()
    table_doubles: frozenset[int] = frozenset()
    robot_misses: frozenset[int] = frozenset()
    robot_doubles: frozenset[int] = frozenset()


class TableTruth(NamedTuple):
    """What is not visible on the wire, `(n,)` each, by number of the trigger; NaN where there is nothing.

    The table's own angle has the zero of its encoder: where the middle of count 0 is, and the teeth are in the middle
    of the backlash.

    Attributes:
        exposure_deg: The table's own angle when the profile was taken.
        edge_deg: The same when the trigger's edge arrived at the table.
        shaft_deg: The motor's angle at that edge, over the gear ratio.
        latched_deg: The encoder at that edge, with all its digits.
    """

    exposure_deg: FloatArray
    edge_deg: FloatArray
    shaft_deg: FloatArray
    latched_deg: FloatArray


class TriggerLine(GroundTruth, Protocol):
    """What a motion under way sees of the probe: a `trigger` to pull, and a look at the table."""

    def times_s(self) -> FloatArray:
        """Return when each profile was taken so far, by the clock of the table's port."""
        ...

    def stop(self) -> None:
        """Fire no more."""
        ...

    def truth(self) -> TableTruth | None:
        """Return where the table truly was at each trigger; None where the port does not tell."""
        ...


class ProbeOnPort:
    """A probe that runs by itself, wired to the table behind a port in simulated time."""

    def __init__(
        self,
        table: SimulatedBench,
        rate_hz: float,
        delay_s: float = 0.0,
        faults: TriggerFaults | None = None,
        seed: int = 0,
    ) -> None:
        """Wire a probe to a table.

        Args:
            table: The table, as its port carries it.
            rate_hz: Profiles a second.
            delay_s: The longest that an edge is on its way; each takes a random time up to that.
            faults: What goes wrong on the way.
            seed: Chooses these times.
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
        """Return where the table is at this moment."""
        return self._table.status()

    def trigger(self) -> None:
        """Start to run, now; when it runs the probe fires by itself."""
        if not self._is_running:
            self._is_running = True
            self._start_s = self._table.tick / self._tick_hz
            self._next = next(self._coming)
            self._put_on_line(self._table.tick)

    def stop(self) -> None:
        """Fire no more, and let go of the table."""
        self._end_s = self._table.tick / self._tick_hz
        self._table.observer = None

    def times_s(self) -> FloatArray:
        """Return when each profile was taken so far, by the table's clock."""
        now_s = min(self._end_s, self._table.tick / self._tick_hz)
        if self._start_s >= now_s:
            return np.zeros(0)
        taken = np.ceil((now_s - self._start_s) / self._period_s)
        return self._start_s + self._period_s * np.arange(taken, dtype=np.float64)

    def truth(self) -> TableTruth:
        """Return where the table truly was at each trigger."""
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
        """Yield the edges that the table hears, with the number of their trigger where they have one."""
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
        """Put the edges of the tick that begins now on the line."""
        while (at := self._next[0] * self._tick_hz - tick) < 1.0:
            self._table.trigger(max(0.0, at))
            if self._next[1] is not None:
                self._arriving.append(self._next[1])
            self._next = next(self._coming)


class ProbeByHand:
    """A probe that the host fires: an emulator that runs in real time, through a view into it."""

    def __init__(self, view: GroundTruth, clock: Clock) -> None:
        """Take over a view, and the clock of the table's port."""
        self._view, self._clock = view, clock
        self._fired_s: list[float] = []

    def status(self) -> TableStatus:
        """Return where the table is at this moment."""
        return self._view.status()

    def trigger(self) -> None:
        """Take a profile."""
        self._fired_s.append(self._clock.now_s())
        self._view.trigger()

    def stop(self) -> None:
        """Do nothing: it fires when it is told."""

    def times_s(self) -> FloatArray:
        """Return when each profile was taken so far, by the clock of the table's port."""
        return np.array(self._fired_s)

    def truth(self) -> None:
        """Return nothing: by the time a look comes back, the table has moved on."""


def robot_latch_times_s(times_s: FloatArray, delay_s: float, faults: TriggerFaults, seed: int) -> FloatArray:
    """Return when the robot latches, `(m,)` ascending.

    Args:
        times_s: `(n,)` of the triggers.
        delay_s: The longest that an edge is on its way.
        faults: What goes wrong on the way.
        seed: Chooses these times.
    """
    delays_s = delay_s * np.random.default_rng((seed, 6)).random(len(times_s))
    heard = [time_s + delays_s[k] for k, time_s in enumerate(times_s) if k not in faults.robot_misses]
    period_s = float(np.median(np.diff(times_s))) if len(times_s) > 1 else 0.0
    heard += [times_s[k] + 0.5 * period_s for k in faults.robot_doubles if k < len(times_s)]
    return np.array(sorted(heard))
