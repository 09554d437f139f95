"""A check on the emulator: the results of a run, the predictions of the linear model, and the common motions."""

from typing import NamedTuple

from emulator.config.table_config import TableConfig
from tools.emulated import Array

_FAR_S, _RAMP_TO = 100.0, 0.5
_LEAST_RAMP_S = 0.1


class Curve(NamedTuple):
    """A response over time: of the emulator and, if it has one, of the linear model."""

    time_s: Array
    emulator: Array
    model: Array | None


class Figure(NamedTuple):
    """One figure of merit; smaller is better. The key names it in programs, the title in reports."""

    key: str
    title: str
    unit: str
    emulator: float
    model: float | None


class Check(NamedTuple):
    """A run and its results. The key names it in programs, the title in reports."""

    key: str
    title: str
    ordinate: str
    curve: Curve
    figures: tuple[Figure, ...]


def greatest_ramp(config: TableConfig) -> tuple[float, float, float]:
    """Return speed, acceleration and duration of a ramp that is long enough to be visible."""
    speed = _RAMP_TO * config.limits.speed_deg_s
    acceleration = min(config.limits.acceleration_deg_s2, speed / _LEAST_RAMP_S)
    return speed, acceleration, speed / acceleration


def far_deg(config: TableConfig) -> float:
    """Return a target that no run of a check reaches."""
    return _FAR_S * config.limits.speed_deg_s
