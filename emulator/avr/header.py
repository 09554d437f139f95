"""The firmware's constants as a C header, from a table's configuration.

The header holds integers only, in the formats of `emulator.firmware.fixed_point`. A table that the controller cannot
run is refused here, before anything is compiled.
"""

import hashlib
from decimal import Decimal
from fractions import Fraction
from typing import NamedTuple

from emulator.config.constants import firmware_constants
from emulator.config.table_config import ConfigError, TableConfig
from emulator.firmware.fixed_point import GAIN_BITS, INTEGRAL_GAIN_BITS
from emulator.firmware.pid import Gains
from emulator.table.interpreter import Interpreter

CLOCK_HZ = 16_000_000
MOST_EDGES_S = 30_000
"""Edges of the encoder a second that the interrupt counts without loss, with the line busy."""
MOST_BAUD = 115_200
MOST_TICK_HZ = 1250
"""With a faster line or tick, its interrupts take the time of the tick: edges and ticks are lost."""
_MOST_WINDOW_TICKS = 64
_TIMER_CLOCKS = {1: 1, 8: 2, 32: 3, 64: 4, 128: 5, 256: 6, 1024: 7}
"""The prescalers of timer 2, and the bits that select them."""
_RATE_TOLERANCE = Fraction(22, 1000)
_MOST_DIVIDER = 4095
_WORD = 1 << 64


class Uart(NamedTuple):
    """How the controller makes a baud rate of its clock."""

    divider: int
    double_speed: bool

    @property
    def cycles_per_bit(self) -> int:
        """Clock cycles that a bit takes."""
        return (8 if self.double_speed else 16) * (self.divider + 1)


def header_text(config: TableConfig, source: str) -> str:
    """Return the header of a configured table; `source` names its file.

    Raises:
        ConfigError: the controller cannot run such a table.
    """
    body = _body(config)
    digest = hashlib.sha256(body.encode()).hexdigest()[:16]
    return (
        f"/* Made by `python -m tools.firmware_header` from {source}: do not edit. */\n"
        "#ifndef TABLE_CONSTANTS_H\n#define TABLE_CONSTANTS_H\n\n"
        f'#define TABLE_DIGEST "{digest}"\n\n{body}\n#endif\n'
    )


def digest_of(config: TableConfig) -> str:
    """Return what names the constants of a table in its firmware."""
    return hashlib.sha256(_body(config).encode()).hexdigest()[:16]


def uart_of(baud: int) -> Uart:
    """Return the setting nearest to a baud rate; of two the one at normal speed, which samples a bit more often.

    Raises:
        ConfigError: no setting is near enough.
    """
    settings = [
        Uart(divider, double_speed)
        for double_speed in (False, True)
        if 0 < baud <= MOST_BAUD and 0 <= (divider := _divider(baud, double_speed=double_speed)) <= _MOST_DIVIDER
    ]
    nearest = min(settings, key=lambda uart: _rate_error(uart, baud), default=None)
    if nearest is None or _rate_error(nearest, baud) > _RATE_TOLERANCE:
        raise ConfigError(
            f"serial.baud is {baud}; a controller of 16 MHz makes rates of 244 to {MOST_BAUD} baud that it divides "
            "within 2.2 %, such as 9600, 38400 and 57600"
        )
    return nearest


def _divider(baud: int, *, double_speed: bool) -> int:
    return round(Fraction(CLOCK_HZ, (8 if double_speed else 16) * baud)) - 1


def _rate_error(uart: Uart, baud: int) -> Fraction:
    return abs(Fraction(CLOCK_HZ, uart.cycles_per_bit * baud) - 1)


def _tick_timer(tick_hz: int) -> tuple[int, int]:
    """Return prescaler and counts of timer 2 for a tick of exactly this rate."""
    for prescaler in _TIMER_CLOCKS:
        counts = Fraction(CLOCK_HZ, prescaler * tick_hz)
        if counts.denominator == 1 and 2 <= counts <= 256 and tick_hz <= MOST_TICK_HZ:
            return prescaler, int(counts)
    raise ConfigError(
        f"control.tick_hz is {tick_hz}; a controller of 16 MHz with an 8-bit timer makes ticks of 62.5 to "
        f"{MOST_TICK_HZ} Hz that divide its clock, such as 250, 500, 625, 1000 and 1250"
    )


def _body(config: TableConfig) -> str:
    _check(config)
    constants, registers = firmware_constants(config), Interpreter(config).power_on()
    prescaler, counts = _tick_timer(config.control.tick_hz)
    uart, serial, count_deg, tick_hz = (
        uart_of(config.serial.baud),
        config.serial,
        config.counts_per_turn / 360,
        config.control.tick_hz,
    )
    angle = Fraction(2 * 10**serial.decimals) / count_deg
    sections: list[tuple[str, dict[str, str | int]]] = [
        (
            "Timers and line, at 16 MHz",
            {
                "TICK_HZ": tick_hz,
                "TICK_TIMER_CLOCK": f"{_TIMER_CLOCKS[prescaler]} /* prescaler {prescaler} */",
                "TICK_TIMER_TOP": counts - 1,
                "UART_DIVIDER": uart.divider,
                "UART_DOUBLE_SPEED": int(uart.double_speed),
                "DUTY_MAX": config.driver.duty_max,
            },
        ),
        ("Replies", {"DECIMALS": serial.decimals, "STRICT_TABLE1": int(serial.strict)}),
        (
            "Controller; speeds in counts a tick with MOTION_BITS fraction bits",
            {
                "MOTION_BITS": constants.motion_bits,
                "SPEED_WINDOW_TICKS": constants.window_ticks,
                "ARRIVAL_COUNT": _long(constants.arrival_count),
                "ARRIVAL_TICKS": f"{constants.arrival_ticks}UL",
                "APPROACH_RATE": _long(constants.approach_rate),
                "APPROACH_SPEED": _long(constants.approach_speed),
                "STALL_DUTY": constants.stall_duty,
                "STALL_TICKS": f"{constants.stall_ticks}UL",
                "SETTLING_TICKS": f"{constants.settling_ticks}UL",
                "POWER_ON_SPEED": _long(registers.speed),
                "POWER_ON_ACCELERATION": _long(registers.acceleration),
            },
        ),
        (
            "Limits, as the decimals that a command must not exceed",
            {
                "SPEED_LIMIT": f'"{_plain(config.limits.speed_deg_s)}"',
                "ACCELERATION_LIMIT": f'"{_plain(config.limits.acceleration_deg_s2)}"',
                "POSITION_WHOLE_MAX": f"{int(2**31 / count_deg)}UL",
            },
        ),
        (
            "From degrees to counts, as fractions in lowest terms",
            _scale("POSITION", count_deg)
            | _scale("SPEED", count_deg / tick_hz)
            | _scale("ACCELERATION", count_deg / tick_hz**2),
        ),
        ("From counts to half units of the last decimal of a reply", _scale("ANGLE", angle)),
    ]
    parts = [_section(title, macros) for title, macros in sections]
    return "\n".join([*parts, _gains(config, constants.pid.ramp, constants.pid.hold)])


def _gains(config: TableConfig, ramp: Gains, hold: Gains) -> str:
    """Return the gain sets by the names that `tools.tune` gives them in its `gains.h`, which replaces them."""
    gains: dict[str, str | int] = {
        "GAIN_FRACTION_BITS": GAIN_BITS,
        "INTEGRAL_GAIN_FRACTION_BITS": INTEGRAL_GAIN_BITS,
    } | {
        f"GAINS_{name}_{key.upper()}": _long(gain)
        for name, chosen in (("RAMP", ramp), ("HOLD", hold))
        for key, gain in chosen._asdict().items()
    }
    control = config.control
    return (
        "#ifndef TABLE_GAINS_H /* else `gains.h` of `python -m tools.tune` has been included before */\n"
        f"{_section('Gains: PWM steps for a speed error of one count a window', gains)}"
        f"#elif GAINS_TICK_HZ != {control.tick_hz} || GAINS_SPEED_WINDOW_TICKS != {control.speed_window_ticks} || "
        f"GAINS_DUTY_MAX != {config.driver.duty_max}\n"
        '#error "gains.h is for another tick, window or PWM"\n#endif\n'
    )


def _section(title: str, macros: dict[str, str | int]) -> str:
    lines = [f"#define {name:<28} {value}" for name, value in macros.items()]
    return "\n".join([f"/* {title}. */", *lines, ""])


def _scale(name: str, factor: Fraction) -> dict[str, str | int]:
    return {f"{name}_NUMERATOR": f"{factor.numerator}UL", f"{name}_DIVISOR": f"{factor.denominator}UL"}


def _long(value: int) -> str:
    return f"{value}L"


def _plain(value: float) -> str:
    """Return a number as it was written in the file, without an exponent."""
    return f"{Decimal(repr(value)):f}"


def _check(config: TableConfig) -> None:
    """Refuse what the controller's registers or its speed do not allow."""
    edges_s = config.limits.speed_deg_s * config.counts_per_deg
    if edges_s > MOST_EDGES_S:
        raise ConfigError(
            f"limits.speed_deg_s is {config.limits.speed_deg_s:g}, {edges_s:.0f} edges of the encoder a second; the "
            f"controller counts {MOST_EDGES_S}; lower it, encoder.lines or gears.ratio"
        )
    if config.control.speed_window_ticks > _MOST_WINDOW_TICKS:
        raise ConfigError(
            f"control.speed_window_ticks is {config.control.speed_window_ticks}; the controller has memory for "
            f"{_MOST_WINDOW_TICKS}"
        )
    count_deg, tick_hz, bits = config.counts_per_turn / 360, config.control.tick_hz, config.motion_bits
    factors = (count_deg, count_deg / tick_hz, count_deg / tick_hz**2)
    fits = all(
        100 * (factor.numerator << (bits + 1)) < _WORD
        and (factor.denominator * factor.numerator << (bits + 1)) < _WORD
        and factor.denominator < 1 << 32
        for factor in factors
    )
    angle = Fraction(2 * 10**config.serial.decimals) / count_deg
    if not fits or count_deg < 1 or angle.numerator >= 1 << 32 or angle.denominator >= 1 << 32:
        raise ConfigError(
            f"encoder.lines {config.encoder.lines} and gears.ratio {config.gears.ratio:g} give {count_deg} counts a "
            "degree; the controller holds fractions of smaller integers, of at least one count a degree: choose a "
            "ratio with smaller numbers of teeth, or fewer serial.decimals"
        )
