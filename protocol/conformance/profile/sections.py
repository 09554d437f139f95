"""The sections of a profile, key by key; what each key means is said in `default.toml`."""

from dataclasses import dataclass


@dataclass(frozen=True)
class TableProfile:
    """Which table it is."""

    name: str
    counts_per_deg: float


@dataclass(frozen=True)
class SerialProfile:
    """The line, and the times on it."""

    baud: int
    decimals: int
    error_replies: bool
    buffer_bytes: int
    latency_s: float
    timeout_s: float


@dataclass(frozen=True)
class MotionValues:
    """A speed and an acceleration."""

    speed_deg_s: float
    acceleration_deg_s2: float


@dataclass(frozen=True)
class Tolerance:
    """How exact the table must be."""

    rest_deg: float
    tracking_deg: float
    duration_share: float
    duration_s: float
    speed_share: float
    acceleration_share: float
    settling_s: float


@dataclass(frozen=True)
class MotionAllowed:
    """How far, each way from its first position, and how fast the table may be moved."""

    reach_deg: float
    speed_deg_s: float
    acceleration_deg_s2: float

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
