"""The bench: observe a table, and act on it, without the serial line.

An emulated table in this process is a `SimulatedBench`. An emulator in another process has the bench of its
`control_channel`. A real table has none.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, ClassVar, NamedTuple, Protocol, dataclass_transform, runtime_checkable

from protocol.errors import TableError


class BenchError(TableError):
    """An operation on the bench failed; the message names the cause."""


class TableFacts(NamedTuple):
    """The constants of a table that its clients may rely on."""

    tick_hz: int  # of the firmware's clock
    counts_per_deg: float
    max_speed_deg_s: float
    max_acceleration_deg_s2: float


class TableStatus(NamedTuple):
    """The state of a table at one moment.

    Angles are unwrapped. The true angle is that of the table itself, behind the backlash.
    """

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
    shaft_deg: float  # position of the motor shaft, without quantization by the encoder
    gap_deg: float  # angle by which the shaft is ahead of the table: at most half the backlash in either direction


@dataclass_transform(kw_only_default=True, frozen_default=True)
@dataclass(frozen=True, kw_only=True)
class Fault:
    """A fault that can be injected. Each kind is a subclass with its own numbers, in `emulator.faults`.

    The annotation of a number holds its allowed closed interval and its help text.
    """

    kind: ClassVar[str]
    at_s: Annotated[float | None, 0.0, 1e9, "starts at this time since the table was switched on (default: now)"] = None
    at_command: Annotated[int | None, 1, 1e9, "starts with this command, counted from power-on (default: now)"] = None
    for_s: Annotated[float | None, 0.001, 1e9, "duration (default: until it is cleared)"] = None

    def __init_subclass__(cls, kind: str) -> None:
        """Make a kind of fault a frozen dataclass with a name, which users give to select it."""
        cls.kind = kind
        dataclass(frozen=True, kw_only=True)(cls)

    def numbers(self) -> dict[str, float]:
        """Return all its numbers by their names."""
        return {name: value for name, value in vars(self).items() if value is not None}


Observer = Callable[[TableStatus, bytes, bytes], None]
"""Called after each tick with the status, the bytes that the firmware has read, and the bytes that have been sent."""


class GroundTruth(Protocol):
    """A table whose state can be read and whose latch can be triggered."""

    def status(self) -> TableStatus:
        """Return the present state of the table."""
        ...

    def trigger(self) -> None:
        """Latch the position now, as the probe's trigger signal does."""
        ...


class Bench(GroundTruth, Protocol):
    """The bench of any emulated table. Over a control channel, each method may raise a `BenchError`."""

    @property
    def facts(self) -> TableFacts:
        """The table's constants."""
        ...

    def set_load_torque(self, torque_Nm: float) -> None:
        """Apply a load torque that opposes positive rotation, until the next call."""
        ...

    def reset(self, count: int = 0) -> None:
        """Cut the table's power and switch it on again; its counter starts at `count`."""
        ...

    def inject(self, fault: Fault) -> None:
        """Inject a fault, now or at the time that the fault specifies."""
        ...

    def clear_faults(self) -> None:
        """End all faults and cancel the scheduled ones."""
        ...


@runtime_checkable
class SimulatedBench(Bench, Protocol):
    """A table in this process. Its time passes only when the caller advances it.

    Attributes:
        observer: called after every tick, if set.
    """

    observer: Observer | None

    @property
    def tick(self) -> int:
        """Ticks since the table was switched on."""
        ...

    def trigger(self, fraction: float = 0.0) -> None:
        """Apply an edge to the trigger input at a fraction (0..1) of the coming tick.

        The latch stores the position of that instant.
        """
        ...

    def advance(self, ticks: int) -> None:
        """Advance the simulated time."""
        ...


def bench_of(port: object) -> SimulatedBench | None:
    """Return the simulated table that `port` carries as `port.table`, else None."""
    table = getattr(port, "table", None)
    return table if isinstance(table, SimulatedBench) else None
