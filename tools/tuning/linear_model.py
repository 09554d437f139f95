"""The speed loop as a linear sampled system, from the same configuration that the emulator runs on.

Between two control ticks the duty is held, so motor, gears and load are discretised with a zero-order hold. The
loop's timing is the firmware's: the speed is the count's difference over a window of W ticks, and a new duty waits one
tick in the PWM's buffer before it is on the bridge (`emulator.table.tick`).

What is not linear is left out and stated elsewhere: dry friction acts as a constant load while the table turns, the
quantisation of speed and PWM as two noises (`quantisation_noise`), and the backlash as the states of `Teeth`.
"""

from enum import StrEnum
from math import degrees, sqrt

import control
import numpy as np
from numpy.typing import NDArray

from emulator.config.table_config import TableConfig
from emulator.firmware.fixed_point import GAIN_BITS, INTEGRAL_GAIN_BITS
from emulator.firmware.pid import Gains

Array = NDArray[np.float64]

INTEGRAL_STATE = -3
"""Where the regulator's integral stands in the state of `closed_loop`."""


class Teeth(StrEnum):
    """What the motor turns, by the state of the backlash (`emulator.plant.drive_train`)."""

    DRIVING = "engaged, driving"
    OVERHAULING = "engaged, overhauling"
    FREE = "free"


def load_ratio(config: TableConfig, teeth: Teeth) -> float:
    """Return the torque at the motor for a torque at the table: the efficiency depends on who drives."""
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


def plant(config: TableConfig, teeth: Teeth) -> control.StateSpace:
    """Return the sampled plant from duty and load to true and measured speed.

    Inputs: `duty` on the bridge (1 is full), `load_Nm` against positive rotation at the table. Outputs: `speed_deg_s`
    of the motor as the table would turn with it, `measured_deg_s`, its mean over the window. States: current, speed,
    and the angle made in each of the last W ticks; as these are kept, and no angle, nothing integrates without end.
    """
    tick_s, window = 1.0 / config.control.tick_hz, config.control.speed_window_ticks
    motor = control.ss(*motor_system(config, teeth), np.eye(3), np.zeros((3, 2)))
    held = control.sample_system(motor, tick_s, method="zoh")
    inputs = np.diag([config.driver.supply_V, load_ratio(config, teeth)])
    size = 2 + window
    a, b = np.zeros((size, size)), np.zeros((size, 2))
    a[:3, :2], b[:3] = held.A[:, :2], held.B @ inputs  # the third row is the angle made in this tick
    a[3:, 2:-1] = np.eye(window - 1)
    table_deg = degrees(1.0 / config.gears.ratio)
    c = np.zeros((2, size))
    c[0, 1] = table_deg
    c[1, 2:] = table_deg / (window * tick_s)
    return control.ss(
        a, b, c, np.zeros((2, 2)), tick_s, inputs=["duty", "load_Nm"], outputs=["speed_deg_s", "measured_deg_s"]
    )


def duty_gains(config: TableConfig, gains: Gains | Array) -> Array:
    """Return register values as gains in duty per deg/s: proportional, integral a tick, derivative a tick.

    Args:
        config: The table.
        gains: (..., 3) register values, or one `Gains`.
    """
    quantum_deg_s = speed_quantum_deg_s(config)
    scale = np.array([2.0**-GAIN_BITS, 2.0**-INTEGRAL_GAIN_BITS, 2.0**-GAIN_BITS])
    result: Array = np.asarray(gains, dtype=np.float64) * scale / (config.driver.duty_max * quantum_deg_s)
    return result


def speed_quantum_deg_s(config: TableConfig) -> float:
    """Return the speed of one count a window."""
    return 1.0 / config.counts_per_deg * config.control.tick_hz / config.control.speed_window_ticks


def regulator(config: TableConfig, gains: Gains) -> control.StateSpace:
    """Return the PID with the PWM's buffer behind it: inputs `reference_deg_s`, `measured_deg_s`, output `duty`."""
    proportional, integral, derivative = duty_gains(config, gains)
    direct = proportional + integral
    return control.ss(  # states: integral, last measured speed, duty in the buffer
        [[1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [1.0, derivative, 0.0]],
        [[integral, -integral], [0.0, 1.0], [direct, -direct - derivative]],
        [[0.0, 0.0, 1.0]],
        [[0.0, 0.0]],
        1.0 / config.control.tick_hz,
        inputs=["reference_deg_s", "measured_deg_s"],
        outputs=["duty"],
    )


def closed_loop(config: TableConfig, teeth: Teeth, gains: Gains) -> control.StateSpace:
    """Return the closed loop: inputs `reference_deg_s`, `load_Nm`; outputs `speed_deg_s`, `measured_deg_s`, `duty`."""
    return control.interconnect(
        [plant(config, teeth), regulator(config, gains)],
        inputs=["reference_deg_s", "load_Nm"],
        outputs=["speed_deg_s", "measured_deg_s", "duty"],
    )


def quantisation_noise(config: TableConfig) -> tuple[float, float]:
    """Return the standard deviations of the two quantisations: of a count in deg, of the PWM in duty.

    Rounding to a step is taken as white noise, uniform over the step: step / sqrt(12).
    """
    return 1.0 / config.counts_per_deg / sqrt(12.0), 1.0 / config.driver.duty_max / sqrt(12.0)


def moving_friction_Nm(config: TableConfig) -> float:
    """Return the dry friction of a table that is driven, as a torque at the table."""
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
