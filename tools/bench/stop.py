"""The result of a stop at many times of the shipped plans: travel, duration, and distance back.

A plan runs once in virtual time. At regular uses of its port (before a line is written, or while a reply is waited for)
table and client are copied. The copies are stopped, as Ctrl-C at this time would do.
"""

import copy
import re
from collections.abc import Callable
from typing import NamedTuple, TextIO

from emulator.faults.fault import HangUp
from emulator.protocol_emulator import Serial
from planner.defaults import shipped_scans
from planner.execution.execute import bring_to, execute
from planner.execution.run_input import RunInput
from planner.execution.table_motion import TableMotion
from planner.table.wire import Wire
from protocol import Clock, NotStopped, TableClient
from protocol.bench import SimulatedBench, bench_of
from tools.bench.timing import print_table
from tools.bench.virtual_run import shipped_run_input

EVERY = 20
"""Number of uses of the port from one check to the next."""
_SAID_DEG = 0.15
_TOLD_DEG = re.compile(r"its last target, (-?[0-9.]+) deg")
ALLOWED_DEG, ALLOWED_S, ALLOWED_BACK_DEG = 1.0, 0.5, 1.0
"""Allowed excess over the braking distance v^2 / (2 A) and the braking time v / A, and allowed distance back."""


class Stopped(NamedTuple):
    """The motion of the reference from a stop on; the first two are the excess over braking at A."""

    beyond_deg: float
    beyond_s: float
    back_deg: float
    speed_deg_s: float
    way_deg: float

    @property
    def is_right(self) -> bool:
        """Whether the stop is within the promised bounds."""
        return self.beyond_deg <= ALLOWED_DEG and self.beyond_s <= ALLOWED_S and self.back_deg <= ALLOWED_BACK_DEG


class CutOff(NamedTuple):
    """The motion of a table that could not be stopped: angle and time until rest, deviation from the prediction."""

    way_deg: float
    rest_s: float
    from_told_deg: float


class Moment(NamedTuple):
    """The possible consequences for a table at one time."""

    stopped: Stopped
    cut_off: CutOff


class MomentsPort:
    """A port onto a simulated table that calls `at_moment` at regular intervals. A copy has its own table."""

    def __init__(self, url: str, every: int, at_moment: Callable[[], None]) -> None:
        self._inner = Serial(url, timeout=0.5)
        self._every, self._at_moment, self._uses = every, at_moment, 0

    @property
    def table(self) -> SimulatedBench:
        """The simulated table."""
        return self._inner.table

    @property
    def clock(self) -> Clock:
        """The time of the table."""
        return self._inner.clock

    @property
    def timeout(self) -> float | None:
        """The maximum time that `read` waits, in seconds."""
        return self._inner.timeout

    @timeout.setter
    def timeout(self, timeout_s: float | None) -> None:
        self._inner.timeout = timeout_s

    @property
    def in_waiting(self) -> int:
        """The number of bytes that can be read without waiting."""
        return self._inner.in_waiting

    def read(self, size: int, /) -> bytes:
        """Return `size` bytes, or fewer after `timeout`."""
        self._use()
        return self._inner.read(size)

    def write(self, data: bytes, /) -> int:
        """Send all of `data`."""
        self._use()
        return self._inner.write(data)

    def close(self) -> None:
        """Close the port."""
        self._inner.close()

    def _use(self) -> None:
        self._uses += 1
        if self._every and self._uses % self._every == 0:
            every, self._every = self._every, 0  # a copy is not examined
            self._at_moment()
            self._every = every


def stops_along(run_input: RunInput, every: int = EVERY, url: str = "emulator://") -> list[Moment]:
    """Run a plan in virtual time; return how it would have been stopped, and run on, at regular times."""
    wire, limits = Wire(), run_input.problem.limits
    motion = TableMotion(run_input.plan, limits)
    moments: list[Moment] = []

    def at_moment() -> None:
        moments.append(Moment(stop_copy(table, limits.acceleration_deg_s2), cut_off_copy(table)))

    port = MomentsPort(url, every, at_moment)
    with TableClient(port, timeout_s=0.5, decimals=wire.decimals) as table:
        bring_to(table, motion.start_deg, limits, wire)
        moments.clear()  # share of the travel to the start
        record = execute(table, motion, limits, wire)
    assert record.failure is None, record.failure
    return moments


def stop_copy(client: TableClient, acceleration_deg_s2: float) -> Stopped:
    """Stop a copy of a table, and return the motion of its reference."""
    client = copy.deepcopy(client)
    table = _table_of(client)
    before = table.status()
    seen = [before]
    table.observer = lambda status, _heard, _said: seen.append(status)
    position_deg = client.stop()
    speed_deg_s = abs(before.reference_speed_deg_s)
    forward = -1.0 if before.reference_speed_deg_s < 0.0 else 1.0
    ways_deg = [forward * (each.reference_deg - before.reference_deg) for each in seen]
    last = max((each.tick for each in seen if each.reference_speed_deg_s), default=before.tick)
    assert abs(position_deg - seen[-1].reference_deg) < _SAID_DEG, "it stands where reported"
    return Stopped(
        beyond_deg=max(ways_deg) - speed_deg_s**2 / (2.0 * acceleration_deg_s2),
        beyond_s=(last - before.tick) / table.facts.tick_hz - speed_deg_s / acceleration_deg_s2,
        back_deg=max(ways_deg) - ways_deg[-1],
        speed_deg_s=speed_deg_s,
        way_deg=max(ways_deg),
    )


def cut_off_copy(client: TableClient) -> CutOff:
    """Cut the line to a copy of a table, try to stop it, and wait until it rests."""
    client = copy.deepcopy(client)
    table = _table_of(client)
    before = table.status()
    table.inject(HangUp())
    try:
        client.stop()
    except NotStopped as error:
        told = str(error)
    while table.status().state not in {"idle", "stalled"}:
        table.advance(100)
    after = table.status()
    found = _TOLD_DEG.search(told)
    told_deg = float(found[1]) if found else float("nan")
    way_deg = abs(after.reference_deg - before.reference_deg)
    return CutOff(way_deg, (after.tick - before.tick) / table.facts.tick_hz, abs(told_deg - after.reference_deg))


def bench(stream: TextIO, every: int = EVERY) -> None:
    """Stop and cut off every shipped plan, and print the worst figures."""
    rows = []
    for name in shipped_scans():
        run_input = shipped_run_input(name)
        moments = stops_along(run_input, every)
        stops, cuts = zip(*moments, strict=True)
        rows.append(
            (
                name,
                f"{len(moments)}",
                f"{max(each.speed_deg_s for each in stops):.1f}",
                f"{max(each.beyond_deg for each in stops):.2f}",
                f"{max(each.beyond_s for each in stops):.2f}",
                f"{max(each.back_deg for each in stops):.2f}",
                f"{sum(not each.is_right for each in stops)}",
                f"{max(each.way_deg for each in cuts):.0f}",
                f"{max(each.rest_s for each in cuts):.0f}",
                f"{max(each.from_told_deg for each in cuts):.2f}",
            )
        )
    header = ("scan", "stops", "deg/s", "deg beyond v^2/2A", "s beyond v/A", "deg back", "wrong",
              "cut: deg on", "s on", "deg from the reported angle")  # fmt: skip
    print_table(stream, "Stops and cut lines along the shipped plans, worst figures", header, rows)


def _table_of(client: TableClient) -> SimulatedBench:
    table = bench_of(client.port)
    assert table is not None
    return table
