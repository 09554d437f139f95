"""Families of tables for the benchmark of the identification."""

from collections.abc import Callable
from math import exp, log
from pathlib import Path
from random import Random
from typing import NamedTuple

from emulator.config.table_config import load_config

SPREAD = {
    "motor.torque_constant_Nm_A": 0.3,
    "motor.rotor_inertia_kg_m2": 0.15,
    "gears.efficiency": 0.1,
    "table.inertia_kg_m2": 0.4,
    "table.bearing_friction_Nm": 0.3,
    "friction.coulomb_Nm": 0.4,
    "friction.stiction_ratio": 0.15,
    "friction.stribeck_speed_rad_s": 0.3,
    "friction.viscous_Nm_s": 0.4,
}
"""Bounds of the logarithms, relative to the default table's constants."""

BACKLASH_ARCMIN = (2.5, 40.0)

_WIDE_SHARE = 2.0
_WIDE_BACKLASH_ARCMIN = (2.0, 60.0)
_WIDE_VISCOUS_NM_S = (0.3e-6, 10e-6)
_WIDE_INERTIA = (0.3, 5.0)
_RATIOS = (120.0, 240.0, 300.0, 480.0, 600.0)
_LINES = (50, 64, 96, 100, 128, 256, 500)
_COUNTS_A_TICK = (5.0, 30.0)
"""Noise limit of a usable encoder, at 40 deg/s."""
_GREATEST_EFFICIENCY = 0.95

Constants = dict[str, float]
"""The keys in a table's configuration."""


class Table(NamedTuple):
    """A table: its known constants, and those that the fit must find."""

    known: Constants
    hidden: Constants


class Family(NamedTuple):
    """Tables by their seeds, and the allowed errors."""

    title: str
    table: Callable[[int], Table]
    bounds: dict[str, float]


def narrow(seed: int) -> Table:
    """Return a table that differs from the default one in its physical constants only."""
    return Table({}, random_plant(seed))


def wide(seed: int) -> Table:
    """Return a table from ranges twice as wide, with another gear ratio and encoder."""
    chance, usual = Random(seed), load_config()  # noqa: S311  # spreads the tables
    hidden = {
        name: _usual(name) * exp(chance.uniform(-_WIDE_SHARE * spread, _WIDE_SHARE * spread))
        for name, spread in SPREAD.items()
    }
    hidden["gears.efficiency"] = min(hidden["gears.efficiency"], _GREATEST_EFFICIENCY)
    hidden["friction.viscous_Nm_s"] = _log_uniform(chance, _WIDE_VISCOUS_NM_S)
    inertia = _log_uniform(chance, _WIDE_INERTIA)
    hidden["gears.backlash_arcmin"] = _log_uniform(chance, _WIDE_BACKLASH_ARCMIN)
    pairs = [(ratio, lines) for ratio in _RATIOS for lines in _LINES if _usable(ratio, lines)]
    ratio, lines = chance.choice(pairs)
    geared = ratio / usual.gears.ratio
    known: Constants = {"gears.ratio": ratio, "encoder.lines": lines}
    for name in ("gains.ramp.proportional_duty_s_deg", "gains.hold.proportional_duty_s_deg"):
        known[name] = _usual(name) * geared  # the same loop
    known["table.inertia_kg_m2"] = _usual("table.inertia_kg_m2") * geared**2  # the same at the motor
    hidden["table.inertia_kg_m2"] = known["table.inertia_kg_m2"] * inertia
    return Table(known, hidden)


def default(_seed: int) -> Table:
    """Return the default table; the seed determines the positions of its shaft and teeth."""
    return Table({}, {})


NARROW = Family(
    "random tables", narrow, {"gain": 0.05, "time constant": 0.05, "Coulomb friction": 0.15, "backlash": 0.2}
)
_STRICT = {"gain": 0.01, "time constant": 0.06, "Coulomb friction": 0.1, "backlash": 0.15}
WIDE = Family("random tables of the wide family", wide, _STRICT)
DEFAULT = Family("the default table", default, _STRICT)


def random_plant(seed: int) -> Constants:
    """Return constants of a table, by their keys in its configuration."""
    chance = Random(seed)  # noqa: S311  # spreads the plants
    plant = {name: _usual(name) * exp(chance.uniform(-spread, spread)) for name, spread in SPREAD.items()}
    plant["gears.backlash_arcmin"] = _log_uniform(chance, BACKLASH_ARCMIN)
    return plant


def write_constants(path: Path, constants: Constants) -> Path:
    """Write a configuration, and return its path."""
    path.write_text("".join(f"{name} = {value!r}\n" for name, value in constants.items()), encoding="utf-8")
    return path


def _usual(name: str) -> float:
    value: object = load_config()
    for part in name.split("."):
        value = getattr(value, part)
    assert isinstance(value, float)
    return value


def _log_uniform(chance: Random, bounds: tuple[float, float]) -> float:
    return exp(chance.uniform(log(bounds[0]), log(bounds[1])))


def _usable(ratio: float, lines: int) -> bool:
    usual = load_config()
    least, most = _COUNTS_A_TICK
    counts = 4 * lines * ratio * usual.limits.speed_deg_s / 360.0 / usual.control.tick_hz
    return least <= counts <= most
