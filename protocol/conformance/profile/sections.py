"""The sections of a profile, key by key; what each key means is said in `default.toml`."""

from dataclasses import dataclass
from typing import Any

from protocol.toml_section import quantity


def _amount() -> Any:  # noqa: ANN401  # stands for a value of the annotated type
    """Declare a number that is not negative."""
    return quantity(at_least=0)


@dataclass(frozen=True)
class TableProfile:
    """Which table it is."""

    name: str
    counts_per_deg: float = quantity(above=0)


@dataclass(frozen=True)
class SerialProfile:
    """The line, and the times on it."""

    baud: int = quantity(at_least=0, at_most=10**9)
    decimals: int = quantity(at_least=1, at_most=6)
    error_replies: bool = quantity()
    buffer_bytes: int = quantity(at_least=33, at_most=10**9)  # a line alone needs 33
    latency_s: float = _amount()
    timeout_s: float = _amount()


@dataclass(frozen=True)
class MotionValues:
    """A speed and an acceleration."""

    speed_deg_s: float = _amount()
    acceleration_deg_s2: float = _amount()


@dataclass(frozen=True)
class Tolerance:
    """How exact the table must be."""

    rest_deg: float = _amount()
    tracking_deg: float = _amount()
    duration_share: float = _amount()
    duration_s: float = _amount()
    speed_share: float = _amount()
    acceleration_share: float = _amount()
    settling_s: float = _amount()


@dataclass(frozen=True)
class MotionAllowed:
    """How far, each way from its first position, and how fast the table may be moved."""

    reach_deg: float = _amount()
    speed_deg_s: float = _amount()
    acceleration_deg_s2: float = _amount()

    def __str__(self) -> str:
        return (
            f"by up to {self.reach_deg:g} deg each way from where it stands, "
            f"at up to {self.speed_deg_s:g} deg/s and {self.acceleration_deg_s2:g} deg/s2"
        )


@dataclass(frozen=True)
class RigProfile:
    """What the rig can do beyond the wire."""

    sees_disconnect: bool
    trigger_command: tuple[str, ...]
    power_cycle_command: tuple[str, ...]
