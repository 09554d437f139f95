"""The active faults of a table.

A fault starts at its time or its command, and ends after its time or when it is cleared.

`line_faults`, `drive_faults` and `trigger_faults` define the effect of an active fault. Their random numbers come from
here, with a fixed seed: the same faults affect the same bytes at the same ticks.
"""

from collections.abc import Collection, Iterable
from random import Random
from typing import NamedTuple, TypeVar

from emulator.faults.fault import KINDS, STRIKES_ONCE, FaultError, HangUp
from protocol.bench import Fault

PORT_KINDS: frozenset[type[Fault]] = frozenset((HangUp,))
"""The faults that this module implements: `FaultSchedule.hangs_up`."""

MOST_PLANS = 1000
"""Maximum number of waiting faults: all of them are checked whenever one starts."""


Kind = TypeVar("Kind", bound=Fault)


class Plan(NamedTuple):
    """A fault that waits for its time or its command, with its duration in ticks."""

    fault: Fault
    begin_tick: int | None
    ticks: int | None


class Active(NamedTuple):
    """An active fault: until a tick, or until it is cleared."""

    fault: Fault
    end_tick: int | None


class FaultSchedule:
    """The faults of one table: the scheduled ones, and the active ones, at most one of each kind.

    Attributes:
        chance: random generator for the effects of faults.
    """

    def __init__(
        self, faults: Iterable[Fault], tick_hz: int, seed: int, effective: Collection[type[Fault]] = KINDS.values()
    ) -> None:
        """Use the faults of a configuration. A fault without a start condition is active from the start.

        Args:
            faults: the faults of the configuration.
            tick_hz: ticks per simulated second.
            seed: random seed of the effects.
            effective: the kinds that have an effect on the table.

        Raises:
            FaultError: see `inject`.
        """
        self._effective = effective
        self.chance = Random(f"faults {seed}")  # noqa: S311  # no secret
        self._tick_hz = tick_hz
        self._plans: list[Plan] = []
        self._active: dict[type[Fault], Active] = {}
        self._lines_heard = 0
        for fault in faults:
            self.inject(fault, 0)

    @property
    def present(self) -> bool:
        """Whether a fault is active or scheduled."""
        return bool(self._plans or self._active)

    @property
    def hangs_up(self) -> bool:
        """Whether the port has disappeared."""
        return HangUp in self._active

    @property
    def next_tick(self) -> int | None:
        """The tick at which a fault starts or ends; None if no such tick is known."""
        ticks = [plan.begin_tick for plan in self._plans] + [one.end_tick for one in self._active.values()]
        return min((tick for tick in ticks if tick is not None), default=None)

    def inject(self, fault: Fault, tick: int) -> bool:
        """Add a fault. It replaces an active one of its kind at its start, or now if it has no start condition.

        Returns:
            Whether the port disappears now, as after `begin_tick` and `begin_line`.

        Raises:
            FaultError: the fault has no effect on this table, or too many faults are waiting.
        """
        if type(fault) not in self._effective:
            effective = ", ".join(sorted(kind.kind for kind in self._effective))
            raise FaultError(f"{fault.kind} has no effect on this table; allowed are {effective}")
        if len(self._plans) >= MOST_PLANS:
            raise FaultError(f"{MOST_PLANS} faults are waiting, which is the maximum; wait until some have started")
        begin = None if fault.at_command is not None else tick
        if fault.at_s is not None:
            begin = max(round(fault.at_s * self._tick_hz), tick)
        ticks = None if fault.for_s is None else max(1, round(fault.for_s * self._tick_hz))
        self._plans.append(Plan(fault, begin, ticks))
        return self.begin_tick(tick)

    def clear(self) -> None:
        """End all faults and cancel the scheduled ones."""
        self._plans.clear()
        self._active.clear()

    def begin_tick(self, tick: int) -> bool:
        """End the faults that are over, and start those that are due. Return whether the port disappears now."""
        if not self.present:
            return False
        was_up = not self.hangs_up
        for kind in [kind for kind, one in self._active.items() if one.end_tick is not None and one.end_tick <= tick]:
            del self._active[kind]
        self._begin([plan for plan in self._plans if plan.begin_tick is not None and plan.begin_tick <= tick], tick)
        return was_up and self.hangs_up

    def begin_line(self, tick: int) -> bool:
        """Count a line received by the firmware, and start the faults that wait for it; return as `begin_tick`."""
        self._lines_heard += 1
        was_up = not self.hangs_up
        self._begin([plan for plan in self._plans if plan.fault.at_command == self._lines_heard], tick)
        return was_up and self.hangs_up

    def holds_any(self, kinds: frozenset[type[Fault]]) -> bool:
        """Return whether a fault of one of these kinds is active."""
        return not kinds.isdisjoint(self._active)

    def holding(self, kind: type[Kind]) -> Kind | None:
        """Return the active fault of a kind, if there is one."""
        one = self._active.get(kind)
        return one.fault if one is not None and isinstance(one.fault, kind) else None

    def spent(self, kind: type[Kind]) -> Kind | None:
        """Return a fault that acts once, and end it."""
        assert issubclass(kind, STRIKES_ONCE)
        fault = self.holding(kind)
        self._active.pop(kind, None)
        return fault

    def strikes(self, probability: float) -> bool:
        """Draw whether a fault has its effect this time."""
        return self.chance.random() < probability

    def _begin(self, plans: list[Plan], tick: int) -> None:
        for plan in plans:
            self._plans.remove(plan)
            end = None if plan.ticks is None else tick + plan.ticks
            self._active[type(plan.fault)] = Active(plan.fault, end)
