"""Gain sets as files: a configuration for the emulator, and a C header in the firmware's formats."""

from dataclasses import fields

from emulator.config.table_config import GainsConfig, TableConfig
from emulator.firmware.fixed_point import GAIN_BITS, INTEGRAL_GAIN_BITS
from emulator.firmware.pid import Gains
from tools.config_file import config_toml
from tools.tuning.linear_model import duty_gains

_COMMENT = (
    "Tuned gain sets, and the constants of the table that they are for where it is not the default one.\nFor --config."
)
_KEYS = frozenset(f"gains.{name}.{entry.name}" for name in ("ramp", "hold") for entry in fields(GainsConfig))


def gains_config(config: TableConfig, gains: Gains) -> GainsConfig:
    """Return register values as gains of the configuration; `fixed_gains` converts them back to the same registers."""
    proportional, integral, derivative = (float(gain) for gain in duty_gains(config, gains))
    tick_s = 1.0 / config.control.tick_hz
    if proportional == 0.0:
        raise ValueError(f"{gains} has no proportional gain; the configuration states the others in proportion to it")
    return GainsConfig(proportional, proportional * tick_s / integral, derivative * tick_s / proportional)


def gains_toml(config: TableConfig) -> str:
    """Return a table and its gain sets for `load_config`, with all digits, so the registers stay the same."""
    return config_toml(config, _COMMENT, always=_KEYS)


def gains_header(config: TableConfig, sets: dict[str, Gains]) -> str:
    """Return the sets as a C header: integers, in PWM steps for a speed error of one count per window."""
    control = config.control
    lines = [
        "/* Tuned gain sets of the rotary table, in the firmware's number format:",
        "   PWM steps for a speed error of one count a window, each tick",
        "       u = PROPORTIONAL e + sum of INTEGRAL e - DERIVATIVE (change of the measured speed).",
        "   They hold for this tick, window and PWM; each fits an int32_t. */",
        "#ifndef TABLE_GAINS_H",
        "#define TABLE_GAINS_H",
        "",
        *_macros(
            {
                "GAINS_TICK_HZ": control.tick_hz,
                "GAINS_SPEED_WINDOW_TICKS": control.speed_window_ticks,
                "GAINS_DUTY_MAX": config.driver.duty_max,
            }
        ),
        "",
        f"#define GAIN_FRACTION_BITS          {GAIN_BITS}  /* proportional and derivative gain */",
        f"#define INTEGRAL_GAIN_FRACTION_BITS {INTEGRAL_GAIN_BITS}  /* integral gain, a tick */",
    ]
    for name, gains in sets.items():
        lines += ["", *_macros({f"GAINS_{name.upper()}_{key.upper()}": gain for key, gain in gains._asdict().items()})]
    return "\n".join([*lines, "", "#endif", ""])


def _macros(values: dict[str, int]) -> list[str]:
    return [f"#define {name:<27} {value}L" for name, value in values.items()]
