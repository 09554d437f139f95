"""Textbook tuning rules for a first-order process with a delay, for comparison with the tuned gain sets.

The process is the table driven by the motor: gain k from duty to speed, time constant T, delay L. L is half of the
speed's window, plus the tick of the PWM's buffer, plus half a tick of the PWM's hold.

    SIMC   S. Skogestad, "Simple analytic rules for model reduction and PID controller tuning", J. Process Control 13
           (2003) 291-309: a closed-loop time constant equal to the delay.
    AMIGO  K. J. Astrom, T. Hagglund, "Revisiting the Ziegler-Nichols step response method for PID control",
           J. Process Control 14 (2004) 635-650: Ms = 1.4.
"""

from typing import NamedTuple

from emulator.config.table_config import GainsConfig, TableConfig
from tools.tuning.linear_model import Teeth, speed_gain_deg_s, time_constant_s


class Process(NamedTuple):
    """k e^(-L s) / (1 + T s)."""

    gain_deg_s: float
    time_constant_s: float
    delay_s: float


def process_of(config: TableConfig) -> Process:
    """Return the first-order process with a delay that approximates a table."""
    control = config.control
    delay_s = (0.5 * control.speed_window_ticks + 1.5) / control.tick_hz
    return Process(speed_gain_deg_s(config), time_constant_s(config, Teeth.DRIVING), delay_s)


def textbook_gains(process: Process) -> dict[str, GainsConfig]:
    """Return the gain set of each rule by its name."""
    k, t, l = process  # noqa: E741  # the letters of the rules
    return {
        "SIMC PI": GainsConfig(t / (k * 2.0 * l), min(t, 8.0 * l), 0.0),
        "AMIGO PI": GainsConfig(
            (0.15 + (0.35 - l * t / (l + t) ** 2) * t / l) / k,
            0.35 * l + 13.0 * l * t**2 / (t**2 + 12.0 * l * t + 7.0 * l**2),
            0.0,
        ),
        "AMIGO PID": GainsConfig(
            (0.2 + 0.45 * t / l) / k, (0.4 * l + 0.8 * t) / (l + 0.1 * t) * l, 0.5 * l * t / (0.3 * l + t)
        ),
    }
