"""The reported constants of a table, with their intervals, and whether a recording identifies them."""

from collections.abc import Callable
from math import exp, log
from typing import NamedTuple

import numpy as np

from emulator.config.table_config import TableConfig
from tools.emulated import Array
from tools.identification.estimation import Estimate
from tools.identification.parameters import PARAMETERS, with_logarithms
from tools.tuning.linear_model import Teeth, load_ratio, speed_gain_deg_s, time_constant_s

_SURE_95 = 1.96

_IDENTIFIABLE_DEVIATION = 0.25
"""Maximum standard deviation of the logarithm of an identifiable constant, from the readings alone.

Prior assumptions are not included."""


class Constant(NamedTuple):
    """An estimated constant with its 95 % confidence interval, and whether the recording alone determines it."""

    name: str
    unit: str
    value: float
    low: float
    high: float
    identifiable: bool


Derived = Callable[[TableConfig], float]


def coulomb_Nm(config: TableConfig) -> float:
    """Return the Coulomb friction of a driven table at the motor's shaft, including that of its bearing."""
    return config.friction.coulomb_Nm + config.table.bearing_friction_Nm * load_ratio(config, Teeth.DRIVING)


def coulomb_duty(config: TableConfig) -> float:
    """Return the duty that overcomes the Coulomb friction."""
    motor = config.motor
    return coulomb_Nm(config) * motor.resistance_ohm / motor.torque_constant_Nm_A / config.driver.supply_V


DERIVED: tuple[tuple[str, str, Derived], ...] = (
    ("gain", "deg/s at full duty", speed_gain_deg_s),
    ("time constant", "ms, loaded", lambda config: 1e3 * time_constant_s(config, Teeth.DRIVING)),
    ("time constant, free", "ms, within the backlash", lambda config: 1e3 * time_constant_s(config, Teeth.FREE)),
    ("Coulomb friction", "mNm at the motor, loaded", lambda config: 1e3 * coulomb_Nm(config)),
    ("Coulomb friction as duty", "%", lambda config: 100.0 * coulomb_duty(config)),
    ("stiction", "times the Coulomb friction", lambda config: config.friction.stiction_ratio),
    ("viscous friction", "uNm s", lambda config: 1e6 * config.friction.viscous_Nm_s),
    ("backlash", "arcmin", lambda config: config.gears.backlash_arcmin),
)


def constants_of(config: TableConfig, found: Estimate, deviation: Array, from_drive: bool) -> tuple[Constant, ...]:
    """Return the reported constants, by linear propagation of the covariance.

    Args:
        config: the known constants.
        found: the estimate, in the units of the parameters.
        deviation: (components,) standard deviations of the prior.
        from_drive: whether the delay is that of a drive.
    """
    size = len(PARAMETERS)
    result = []
    for name, unit, function in DERIVED:
        slope = np.zeros(len(found.vector))
        slope[:size] = log_slope(config, found.vector[:size], function)
        before, after = (float(np.sqrt(slope @ spread @ slope)) for spread in (np.diag(deviation**2), found.covariance))
        value = function(with_logarithms(config, found.vector[:size]))
        factor = exp(min(_SURE_95 * after, 50.0))
        result.append(Constant(name, unit, value, value / factor, value * factor, _identifiable(before, after)))
    return (*result, _delay(found, float(deviation[size]), from_drive))


def _identifiable(before: float, after: float) -> bool:
    """Return whether the readings alone determine a quantity, from its standard deviations before and after them."""
    return bool(after**-2.0 - before**-2.0 > _IDENTIFIABLE_DEVIATION**-2.0)


def _delay(found: Estimate, prior: float, from_drive: bool) -> Constant:
    size = len(PARAMETERS)
    after, delay = float(np.sqrt(found.covariance[size, size])), float(found.vector[size])
    unit, scale = ("ticks, duty to bridge", 1.0) if from_drive else ("ms, reading behind command", 1e3)
    spread = _SURE_95 * after
    return Constant(
        "delay", unit, scale * delay, scale * (delay - spread), scale * (delay + spread), bool(after < 0.5 * prior)
    )


def log_slope(config: TableConfig, logarithms: Array, function: Derived) -> Array:
    """Return the derivatives of a quantity's logarithm by the logarithms of the parameters."""
    step = 1e-4
    slopes = []
    for index in range(len(logarithms)):
        shift = np.zeros_like(logarithms)
        shift[index] = step
        ends = [function(with_logarithms(config, logarithms + sign * shift)) for sign in (1.0, -1.0)]
        slopes.append((log(ends[0]) - log(ends[1])) / (2.0 * step))
    return np.array(slopes)
