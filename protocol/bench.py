"""The bench: what can be seen of a table, and done to it, besides talking to it on the wire.

An emulated table in this process is a `SimulatedBench`. An emulator in another process has the bench of its
`control_channel`. A real table has none.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, ClassVar, NamedTuple, Protocol, dataclass_transform, runtime_checkable

from protocol.errors import TableError


class BenchError(TableError):
    """Something beside the wire did not work; the message says what."""


class TableFacts(NamedTuple):
    """The constants of a table that its clients may rely on."""

    tick_hz: int  # of the firmware's clock
    counts_per_deg: float
    max_speed_deg_s: float
    max_acceleration_deg_s2: float


class TableStatus(NamedTuple):
    """One look at a table. Angles are unwrapped; the true one is the table's own, behind the backlash."""

    tick: int
    reference_deg: float
    encoder_deg: float
    true_deg: float
    reference_speed_deg_s: float
    speed_deg_s: float  # as the firmware measures it
    true_speed_deg_s: float
    current_A: float
    duty: float  # -1..1
    gain_set: str  # "ramp" or "hold"
    state: str  # "idle", "moving", "settling" or "stalled"
    latched_deg: float
    received_queue: int  # bytes that the firmware has not read
    transmit_queue: int  # bytes that have not left
    lost_bytes: int
    load_torque_Nm: float
    shaft_deg: float  # what an encoder without steps would read on the motor's shaft
    gap_deg: float  # by how much the shaft is ahead of the table: half the backlash at most, either way


@dataclass_transform(kw_only_default=True, frozen_default=True)
@dataclass(frozen=True, kw_only=True)
class Fault:
    """A fault that can be injected. Each kind is a subclass with its own numbers, in `emulator.faults`.

    The annotation of a number holds the closed interval that it must lie in, and its help.
    """

    kind: ClassVar[str]
    at_s: Annotated[float | None, 0.0, 1e9, "begins at this time since the table was switched on (default: now)"] = None
    at_command: Annotated[
        int | None, 1, 1e9, "begins with this command, counted from the first ever (default: now)"
    ] = None
    for_s: Annotated[float | None, 0.001, 1e9, "lasts so long (default: until it is cleared)"] = None

    def __init_subclass__(cls, kind: str) -> None:
        """Make a kind of fault a frozen value with a name, by which a person calls it."""
        cls.kind = kind
        dataclass(frozen=True, kw_only=True)(cls)

    def numbers(self) -> dict[str, float]:
        """Return all its numbers by their names."""
        return {name: value for name, value in vars(self).items() if value is not None}


Observer = Callable[[TableStatus, bytes, bytes], None]
"""Called after each tick with the status, and the bytes that the firmware has read and that have left."""


class GroundTruth(Protocol):
    """A table that can be looked into and triggered."""

    def status(self) -> TableStatus:
        """Return the table as it is at this moment."""
        ...

    def trigger(self) -> None:
        """Latch the position at this moment, as the probe's signal does."""
        ...


class Bench(GroundTruth, Protocol):
    """The bench of any emulated table. Over a control channel each of these may raise a `BenchError`."""

    @property
    def facts(self) -> TableFacts:
        """The table's constants."""
        ...

    def set_load_torque(self, torque_Nm: float) -> None:
        """Load the table with a torque that resists positive rotation, until it is set anew."""
        ...

    def reset(self, count: int = 0) -> None:
        """Cut the table's power and switch it on again; its counter begins at `count`."""
        ...

    def inject(self, fault: Fault) -> None:
        """Let something go wrong, now or when the fault says."""
        ...

    def clear_faults(self) -> None:
        """End all faults, and forget those to come."""
        ...


@runtime_checkable
class SimulatedBench(Bench, Protocol):
    """A table in this process, whose time passes only when it is told.

    Attributes:
        observer: who sees every tick, if anybody.
    """

    observer: Observer | None

    @property
    def tick(self) -> int:
        """Ticks since the table was switched on."""
        ...

    def trigger(self, fraction: float = 0.0) -> None:
        """Put an edge on the trigger input, at a fraction (0..1) of the coming tick; the latch follows it."""
        ...

    def advance(self, ticks: int) -> None:
        """Let simulated time pass."""
        ...


def bench_of(port: object) -> SimulatedBench | None:
    """Return the simulated table that `port` carries as `port.table`, else None."""
    table = getattr(port, "table", None)
    return table if isinstance(table, SimulatedBench) else None
