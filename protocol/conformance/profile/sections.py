"""The sections of a profile, key by key. `default.toml` explains each key."""

from dataclasses import dataclass
from typing import Any

from protocol.files.toml_section import quantity


def _amount() -> Any:  # noqa: ANN401  # returned in place of a value of the annotated type
    """Declare a number that is not negative."""
    return quantity(at_least=0)


@dataclass(frozen=True)
class TableProfile:
    """Identity of the table."""

    name: str
    counts_per_deg: float = quantity(above=0)


@dataclass(frozen=True)
class SerialProfile:
    """The serial line, and its times."""

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
    """Required accuracy of the table."""

    rest_deg: float = _amount()
    tracking_deg: float = _amount()
    duration_share: float = _amount()
    duration_s: float = _amount()
    speed_share: float = _amount()
    acceleration_share: float = _amount()
    settling_s: float = _amount()


@dataclass(frozen=True)
class MotionAllowed:
    """The allowed motion: the range in each direction from the first position, and the speed."""

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
    """Actions of the rig besides the serial line."""

    sees_disconnect: bool
    trigger_command: tuple[str, ...]
    power_cycle_command: tuple[str, ...]
