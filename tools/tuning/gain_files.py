"""Gain sets as files: a TOML section for the emulator's configuration, and a C header in the firmware's formats."""

from emulator.config import GainsConfig, TableConfig
from emulator.fixed_point import GAIN_BITS, INTEGRAL_GAIN_BITS
from emulator.pid import Gains
from tools.tuning.linear_model import duty_gains


def gains_config(config: TableConfig, gains: Gains) -> GainsConfig:
    """Return register values as the configuration states a gain set; `fixed_gains` gives the same registers back."""
    proportional, integral, derivative = (float(gain) for gain in duty_gains(config, gains))
    tick_s = 1.0 / config.control.tick_hz
    if proportional == 0.0:
        raise ValueError(f"{gains} has no proportional gain; the configuration states the others in proportion to it")
    return GainsConfig(proportional, proportional * tick_s / integral, derivative * tick_s / proportional)


def gains_toml(sets: dict[str, GainsConfig]) -> str:
    """Return the sets as `load_config` reads them; all digits, so that the registers come out the same."""
    lines = ["# Tuned gain sets, for --config."]
    for name, gains in sets.items():
        lines += [
            "",
            f"[gains.{name}]",
            f"proportional_duty_s_deg = {gains.proportional_duty_s_deg!r}",
            f"integral_time_s = {gains.integral_time_s!r}",
            f"derivative_time_s = {gains.derivative_time_s!r}",
        ]
    return "\n".join(lines) + "\n"


def gains_header(sets: dict[str, Gains]) -> str:
    """Return the sets as a C header: integers, in PWM steps for a speed error of one count a window."""
    lines = [
        "/* Tuned gain sets of the rotary table, in the firmware's number format:",
        "   PWM steps for a speed error of one count a window. */",
        "#ifndef TABLE_GAINS_H",
        "#define TABLE_GAINS_H",
        "",
        f"#define GAIN_FRACTION_BITS          {GAIN_BITS}  /* proportional and derivative gain */",
        f"#define INTEGRAL_GAIN_FRACTION_BITS {INTEGRAL_GAIN_BITS}  /* integral gain, a tick */",
    ]
    for name, gains in sets.items():
        lines.append("")
        for key, value in gains._asdict().items():
            macro = f"GAINS_{name.upper()}_{key.upper()}"
            lines.append(f"#define {macro:<27} {value}L")
    return "\n".join([*lines, "", "#endif", ""])
