"""The speed loop from its differential equations, independent of the product's model.

It uses plain numpy, in the frequency domain.

The spectrum of a sampled signal is the sum of the continuous one over its aliases. With the zero-order hold in front,

    G(e^jwT) = sum over n of G(j w_n) (1 - e^-jwT) / (j w_n T),    w_n = w + 2 pi n / T,

so no state space, matrix exponential or difference equation of the product appears here.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from emulator.config.table_config import GainsConfig, TableConfig
from tools.tuning import Teeth

Array = NDArray[np.floating]
Complex = NDArray[np.complex128]

_ALIASES = 200


class Loop(NamedTuple):
    """Frequency responses of one loop, entries along the frequencies."""

    open: Complex
    speed_by_reference: Complex
    speed_by_load: Complex
    duty_by_encoder: Complex


class Margins(NamedTuple):
    """What a textbook reads from an open loop."""

    gain_margin_db: float
    phase_margin_deg: float
    sensitivity_peak: float


def loop(
    config: TableConfig,
    teeth: Teeth,
    gains: GainsConfig,
    hz: Array,
    delay_ticks: int = 1,
    aliases: int = _ALIASES,
) -> Loop:
    """Return the responses at frequencies in Hz, above 0 and up to half the tick rate."""
    tick_s, window = 1.0 / config.control.tick_hz, config.control.speed_window_ticks
    z = np.exp(2j * np.pi * hz * tick_s)
    position, speed, position_load, speed_load = _sampled(config, teeth, hz, aliases)
    window_mean = (1.0 - z**-window) / (window * tick_s)
    delay = z**-delay_ticks
    pi = gains.proportional_duty_s_deg * (1.0 + tick_s / gains.integral_time_s / (1.0 - 1.0 / z))
    pid = pi + gains.proportional_duty_s_deg * gains.derivative_time_s / tick_s * (1.0 - 1.0 / z)
    opened = pid * delay * position * window_mean
    return Loop(
        opened,
        pi * delay * speed / (1.0 + opened),
        speed_load - speed * delay * pid * window_mean * position_load / (1.0 + opened),
        -pid * window_mean / (1.0 + opened),
    )


def margins(opened: Complex) -> Margins:
    """Return the margins of a loop that is given on a fine grid."""
    size = np.log(np.abs(opened))
    crossings = np.flatnonzero(size[:-1] * size[1:] < 0.0)
    share = size[crossings] / (size[crossings] - size[crossings + 1])
    at_one = opened[crossings] + share * (opened[crossings + 1] - opened[crossings])
    turns = np.flatnonzero((opened.imag[:-1] * opened.imag[1:] < 0.0) & (opened.real[:-1] < 0.0))
    share = opened.imag[turns] / (opened.imag[turns] - opened.imag[turns + 1])
    at_axis = opened[turns] + share * (opened[turns + 1] - opened[turns])
    return Margins(
        float(-20.0 * np.log10(np.abs(at_axis).max())),
        float(np.degrees(np.abs(np.angle(-at_one)).min())),
        float(np.max(1.0 / np.abs(1.0 + opened))),
    )


def step_response(response: Complex, at_rest: float) -> Array:
    """Return the answer to a unit step of a response on the grid k / (n T), k = 1 .. n/2, which rests at a value."""
    impulse = np.fft.irfft(np.concatenate([[at_rest], response]))
    return np.asarray(np.cumsum(impulse), dtype=np.float64)


def _sampled(config: TableConfig, teeth: Teeth, hz: Array, aliases: int) -> tuple[Complex, Complex, Complex, Complex]:
    """Return position and speed at the table, in degrees, by the held duty and by the held load."""
    motor, gears, friction = config.motor, config.gears, config.friction
    ratio = {
        Teeth.DRIVING: 1.0 / (gears.efficiency * gears.ratio),
        Teeth.OVERHAULING: gears.efficiency / gears.ratio,
        Teeth.FREE: 0.0,
    }[teeth]
    inertia = motor.rotor_inertia_kg_m2 + gears.inertia_kg_m2 + config.table.inertia_kg_m2 * ratio / gears.ratio
    tick_s = 1.0 / config.control.tick_hz
    s = 2j * np.pi * (hz + np.arange(-aliases, aliases + 1)[:, None] * config.control.tick_hz)
    hold = (1.0 - np.exp(-s * tick_s)) / (s * tick_s)
    electric = motor.resistance_ohm + s * motor.inductance_H
    mechanic = s * inertia + friction.viscous_Nm_s
    common = np.degrees(1.0 / gears.ratio) * hold / (electric * mechanic + motor.torque_constant_Nm_A**2)
    by_duty = motor.torque_constant_Nm_A * config.driver.supply_V * common
    by_load = -ratio * electric * common
    position, speed, position_load, speed_load = (
        part.sum(axis=0) for part in (by_duty / s, by_duty, by_load / s, by_load)
    )
    return position, speed, position_load, speed_load
