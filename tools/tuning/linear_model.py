"""The speed loop as a linear sampled system, from the same configuration as the emulator.

Between two control ticks the duty is held, so motor, gears and load are discretized with a zero-order hold. The timing
is that of the firmware. The speed is the count's difference over a window of W ticks. A new duty waits one tick in the
PWM's buffer before it is applied (`emulator.table.tick`).

Nonlinear effects are modeled elsewhere. Dry friction acts as a constant load while the table turns. The quantization of
speed and PWM is two noises (`quantization_noise`), and the backlash is the states of `Teeth`.
"""

from enum import StrEnum
from math import degrees, radians, sqrt

import control
import numpy as np
from numpy.typing import NDArray

from emulator.config.table_config import TableConfig
from emulator.firmware.fixed_point import GAIN_BITS, INTEGRAL_GAIN_BITS
from emulator.firmware.pid import Gains

Array = NDArray[np.float64]


class Teeth(StrEnum):
    """State of the backlash, which determines the inertia that the motor turns (`emulator.plant.drive_train`)."""

    DRIVING = "driving"
    """The teeth touch, and the motor drives the table."""
    OVERHAULING = "overhauling"
    """The teeth touch, and the table drives the motor."""
    FREE = "free"
    """The teeth do not touch: the motor turns without the table."""


def load_ratio(config: TableConfig, teeth: Teeth) -> float:
    """Return the torque at the motor for a torque at the table; the efficiency depends on the power flow."""
    gears = config.gears
    if teeth is Teeth.FREE:
        return 0.0
    return (1.0 / gears.efficiency if teeth is Teeth.DRIVING else gears.efficiency) / gears.ratio


def inertia_kg_m2(config: TableConfig, teeth: Teeth) -> float:
    """Return the inertia that the motor turns, at its shaft."""
    table = config.table.inertia_kg_m2 * load_ratio(config, teeth) / config.gears.ratio
    return config.motor.rotor_inertia_kg_m2 + config.gears.inertia_kg_m2 + table


def motor_system(config: TableConfig, teeth: Teeth) -> tuple[Array, Array]:
    """Return A and B of the motor: current, speed, angle, driven by voltage (V) and resisting torque (Nm)."""
    r, l, k = config.motor.resistance_ohm, config.motor.inductance_H, config.motor.torque_constant_Nm_A  # noqa: E741  # L
    j, b = inertia_kg_m2(config, teeth), config.friction.viscous_Nm_s
    a = np.array([[-r / l, -k / l, 0.0], [k / j, -b / j, 0.0], [0.0, 1.0, 0.0]])
    return a, np.array([[1.0 / l, 0.0], [0.0, -1.0 / j], [0.0, 0.0]])


def held_motor(config: TableConfig, teeth: Teeth) -> control.StateSpace:
    """Return the motor over one tick, its voltage and torque held: current, speed and angle."""
    motor = control.ss(*motor_system(config, teeth), np.eye(3), np.zeros((3, 2)))
    return control.sample_system(motor, 1.0 / config.control.tick_hz, method="zoh")


def plant(config: TableConfig, teeth: Teeth) -> control.StateSpace:
    """Return the sampled plant, as seen by the controller.

    Inputs: `duty`, which the controller computes in this tick (1 is full; it acts a tick later), `load_Nm`, a torque at
    the table against positive rotation, and `encoder_error_deg`, which is added to the measured position.

    Outputs: `speed_deg_s` of the motor, divided by the gear ratio, and `measured_deg_s`, the encoder's mean over the
    window.

    States: current, speed, the travel in each of the last W ticks, and the duty in the PWM's buffer. No state is the
    position itself, so the plant has no integrator.
    """
    teeth = Teeth(teeth)
    tick_s, window = 1.0 / config.control.tick_hz, config.control.speed_window_ticks
    held = held_motor(config, teeth)
    size = 3 + window
    a, b = np.zeros((size, size)), np.zeros((size, 3))
    a[:3, :2], a[:3, -1] = held.A[:, :2], held.B[:, 0] * config.driver.supply_V
    b[:3, 1] = held.B[:, 1] * load_ratio(config, teeth)  # the third row is the travel in this tick
    a[3:-1, 2:-2] = np.eye(window - 1)
    b[-1, 0] = 1.0
    # Of the reading's errors e(k) .. e(k-W+1) all but the first and the last cancel in the sum over the window.
    b[2:-1, 2] = radians(config.gears.ratio) * np.array([-1.0, 1.0, *[0.0] * window])[:window]
    table_deg = degrees(1.0 / config.gears.ratio)
    c, d = np.zeros((2, size)), np.zeros((2, 3))
    c[0, 1] = table_deg
    c[1, 2:-1] = table_deg / (window * tick_s)
    d[1, 2] = 1.0 / (window * tick_s)
    return control.ss(
        a,
        b,
        c,
        d,
        tick_s,
        inputs=["duty", "load_Nm", "encoder_error_deg"],
        outputs=["speed_deg_s", "measured_deg_s"],
        name=f"plant_{teeth}",
    )


def duty_gains(config: TableConfig, gains: Gains | Array) -> Array:
    """Return register values as gains in duty per deg/s: proportional, integral per tick, derivative per tick.

    Args:
        config: the table.
        gains: (..., 3) register values, or one `Gains`.
    """
    quantum_deg_s = speed_quantum_deg_s(config)
    scale = np.array([2.0**-GAIN_BITS, 2.0**-INTEGRAL_GAIN_BITS, 2.0**-GAIN_BITS])
    result: Array = np.asarray(gains, dtype=np.float64) * scale / (config.driver.duty_max * quantum_deg_s)
    return result


def speed_quantum_deg_s(config: TableConfig) -> float:
    """Return the speed of one count per window."""
    return 1.0 / config.counts_per_deg * config.control.tick_hz / config.control.speed_window_ticks


def quantization_noise(config: TableConfig) -> tuple[float, float]:
    """Return the standard deviations of the two quantizations: of a count in deg, of the PWM in duty.

    Rounding to a step is modeled as white noise, uniform over the step: step / sqrt(12).
    """
    return 1.0 / config.counts_per_deg / sqrt(12.0), 1.0 / config.driver.duty_max / sqrt(12.0)


def moving_friction_Nm(config: TableConfig) -> float:
    """Return the dry friction of a driven table, as a torque at the table."""
    ratio = load_ratio(config, Teeth.DRIVING)
    return config.friction.coulomb_Nm / ratio + config.table.bearing_friction_Nm


def speed_gain_deg_s(config: TableConfig) -> float:
    """Return the table's speed at full duty, without dry friction."""
    r, k, b = config.motor.resistance_ohm, config.motor.torque_constant_Nm_A, config.friction.viscous_Nm_s
    return degrees(config.driver.supply_V * k / (k * k + r * b) / config.gears.ratio)


def time_constant_s(config: TableConfig, teeth: Teeth) -> float:
    """Return the mechanical time constant of what the motor turns."""
    r, k, b = config.motor.resistance_ohm, config.motor.torque_constant_Nm_A, config.friction.viscous_Nm_s
    return r * inertia_kg_m2(config, teeth) / (k * k + r * b)
