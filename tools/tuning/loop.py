"""The speed loop as python-control systems: PID, open loop and closed loop, for gains in engineering units.

    u = K (e + integral(e) / Ti - Td d(measured)/dt),    e = reference - measured

The controller computes `duty` from the measured speed of the same tick. The PWM's tick of delay is in
`linear_model.plant`. All systems are discrete in time with the controller's tick. Their signals have their units in
their names, and their gains are those in the firmware's registers.
"""

from dataclasses import asdict
from math import degrees

import control
import numpy as np

from emulator.config.constants import fixed_gains
from emulator.config.table_config import ConfigError, GainsConfig, TableConfig
from emulator.firmware.pid import Gains
from protocol.files.toml_section import section
from protocol.files.toml_table import TomlTable
from tools.tuning.linear_model import Teeth, duty_gains, held_motor, plant

INTEGRAL_STATE = -2
"""Index of the PID's integral in the state of `closed_loop`."""


def registers(config: TableConfig, gains: GainsConfig) -> Gains:
    """Return gains in engineering units as the firmware's integers; `gains_config` converts them back.

    Args:
        config: the table; tick, window, encoder, gear ratio and PWM determine the registers' units.
        gains: K in duty per deg/s (1 is full duty), Ti and Td in seconds.

    Raises:
        ConfigError: a gain is not finite, out of its range, or does not fit its register.
    """
    return fixed_gains(config, section(GainsConfig, TomlTable("gains", asdict(gains), error=ConfigError), {}))


def regulator(config: TableConfig, gains: GainsConfig | Gains) -> control.StateSpace:
    """Return the PID: inputs `reference_deg_s` and `measured_deg_s`, output `duty`.

    Args:
        config: the table.
        gains: engineering units, which are rounded to registers, or registers.

    Raises:
        ConfigError: as `registers`.
    """
    held = gains if isinstance(gains, Gains) else registers(config, gains)
    proportional, integral, derivative = duty_gains(config, held)
    direct = proportional + integral
    return control.ss(  # states: integral, last measured speed
        [[1.0, 0.0], [0.0, 0.0]],
        [[integral, -integral], [0.0, 1.0]],
        [[1.0, derivative]],
        [[direct, -direct - derivative]],
        1.0 / config.control.tick_hz,
        inputs=["reference_deg_s", "measured_deg_s"],
        outputs=["duty"],
        name="regulator",
    )


def open_loop(config: TableConfig, teeth: Teeth, gains: GainsConfig | Gains) -> control.TransferFunction:
    """Return L = C G for margins, Bode and Nyquist plots and the root locus; 1 + L = 0 at the closed loop's poles.

    C is the response of the PID to the measured speed, including the derivative. G is the plant from duty to measured
    speed. The input is `error_deg_s`, the output `measured_deg_s`. It is a transfer function, because `control.margin`
    and `control.root_locus` compute with polynomials.

    Args:
        config: the table.
        teeth: state of the backlash.
        gains: engineering units, which are rounded to registers, or registers.

    Raises:
        ConfigError: as `registers`.
    """
    teeth = Teeth(teeth)
    held = gains if isinstance(gains, Gains) else registers(config, gains)
    proportional, integral, derivative = duty_gains(config, held)
    tick_s, window = 1.0 / config.control.tick_hz, config.control.speed_window_ticks
    z = control.tf([1.0, 0.0], [1.0], tick_s)
    pid = proportional + integral * z / (z - 1.0) + derivative * (z - 1.0) / z
    motor = held_motor(config, teeth)
    turned = control.ss2tf(motor.A[:2, :2], motor.B[:2, :1], motor.A[2:, :2], motor.B[2:, :1], tick_s)
    # Made from polynomials: a conversion of the whole state space loses all digits with a window of 64 ticks.
    mean = control.tf(np.ones(window), [window * tick_s, *np.zeros(window)], tick_s)
    table_deg_duty = degrees(config.driver.supply_V / config.gears.ratio)
    loop = pid / z * table_deg_duty * turned * mean
    return control.tf(loop, inputs=["error_deg_s"], outputs=["measured_deg_s"], name=f"open_loop_{teeth}")


def closed_loop(config: TableConfig, teeth: Teeth, gains: GainsConfig | Gains) -> control.StateSpace:
    """Return the closed loop; index it by signal names, output first: `loop["speed_deg_s", "load_Nm"]`.

    Inputs `reference_deg_s`, `load_Nm`, `encoder_error_deg`; outputs `speed_deg_s`, `measured_deg_s`, `duty`, each as
    in `linear_model.plant`.

    Args:
        config: the table.
        teeth: state of the backlash.
        gains: engineering units, which are rounded to registers, or registers.

    Raises:
        ConfigError: as `registers`.
    """
    return control.interconnect(
        [plant(config, teeth), regulator(config, gains)],
        inputs=["reference_deg_s", "load_Nm", "encoder_error_deg"],
        outputs=["speed_deg_s", "measured_deg_s", "duty"],
        name=f"closed_loop_{Teeth(teeth)}",
    )


def is_stable(loop: control.StateSpace) -> bool:
    """Return whether all poles of a closed loop are within the unit circle."""
    return bool(np.abs(loop.poles()).max() < 1.0)
