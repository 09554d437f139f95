"""The constants of the compiled firmware, and the tables that it cannot run."""

import re
from dataclasses import replace
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from emulator.avr.header import CLOCK_HZ, digest_of, header_text, uart_of
from emulator.avr.toolchain import CONSTANTS
from emulator.config.table_config import ConfigError, TableConfig, load_config

DEFAULT = load_config()


def macros(config: TableConfig) -> dict[str, str]:
    found = re.findall(r"^#define (\w+) +(.+?)(?: /\*.*)?$", header_text(config, "a test"), re.MULTILINE)
    return {name: value.rstrip("UL") for name, value in found}


def test_the_header_among_the_sources_is_that_of_the_default_table() -> None:
    assert CONSTANTS.read_text(encoding="ascii") == header_text(DEFAULT, "emulator/config/default.toml"), (
        "run python -m tools.firmware_header"
    )


def test_a_factor_to_a_register_is_an_exact_fraction_in_lowest_terms() -> None:
    config = replace(DEFAULT, gears=replace(DEFAULT.gears, ratio=498.9))
    for name, factor in (
        ("POSITION", config.counts_per_turn / 360),
        ("SPEED", config.counts_per_turn / 360 / 1000),
        ("ACCELERATION", config.counts_per_turn / 360 / 1000**2),
        ("ANGLE", 20 / (config.counts_per_turn / 360)),
    ):
        values = macros(config)
        numerator, divisor = int(values[f"{name}_NUMERATOR"]), int(values[f"{name}_DIVISOR"])
        assert (numerator, divisor) == (factor.numerator, factor.denominator)


@pytest.mark.parametrize(("limit", "text"), [(33.3, "33.3"), (1e-5, "0.00001"), (40.0, "40.0")])
def test_a_limit_is_the_decimal_of_the_file(limit: float, text: str) -> None:
    config = replace(
        DEFAULT,
        limits=replace(DEFAULT.limits, speed_deg_s=limit),
        power_on=replace(DEFAULT.power_on, speed_deg_s=limit),
    )
    assert macros(config)["SPEED_LIMIT"] == f'"{text}"'


@pytest.mark.parametrize("tick_hz", [250, 500, 625, 1000, 1250])
def test_the_timer_makes_the_tick_exactly(tick_hz: int) -> None:
    values = macros(replace(DEFAULT, control=replace(DEFAULT.control, tick_hz=tick_hz)))
    prescaler = {"1": 1, "2": 8, "3": 32, "4": 64, "5": 128, "6": 256, "7": 1024}[values["TICK_TIMER_CLOCK"]]
    assert prescaler * (int(values["TICK_TIMER_TOP"]) + 1) * tick_hz == CLOCK_HZ


@pytest.mark.parametrize(
    ("baud", "error"), [(9600, 0.002), (19200, 0.002), (38400, 0.002), (57600, 0.008), (115200, 0.022)]
)
def test_a_common_baud_rate_is_met_as_well_as_the_clock_allows(baud: int, error: float) -> None:
    assert abs(CLOCK_HZ / (uart_of(baud).cycles_per_bit * baud) - 1) < error


@given(st.integers(300, 2_000_000))
def test_a_baud_rate_is_met_within_2_percent_or_refused(baud: int) -> None:
    try:
        uart = uart_of(baud)
    except ConfigError:
        return
    assert abs(Fraction(CLOCK_HZ, uart.cycles_per_bit * baud) - 1) <= Fraction(22, 1000)


def test_other_constants_have_another_digest() -> None:
    assert digest_of(DEFAULT) != digest_of(DEFAULT.with_serial(decimals=2))


@pytest.mark.parametrize(
    ("config", "words"),
    [
        (DEFAULT.with_serial(baud=0), "serial.baud is 0"),
        (DEFAULT.with_serial(baud=250_000), "serial.baud is 250000"),
        (replace(DEFAULT, control=replace(DEFAULT.control, tick_hz=2000)), "control.tick_hz is 2000"),
        (replace(DEFAULT, control=replace(DEFAULT.control, tick_hz=999)), "control.tick_hz is 999"),
        (replace(DEFAULT, control=replace(DEFAULT.control, speed_window_ticks=65)), "speed_window_ticks is 65"),
        (replace(DEFAULT, encoder=replace(DEFAULT.encoder, lines=500)), "edges of the encoder a second"),
        (replace(DEFAULT, gears=replace(DEFAULT.gears, ratio=480.12345)), "counts a degree"),
        (
            replace(DEFAULT, gears=replace(DEFAULT.gears, ratio=1.0), encoder=replace(DEFAULT.encoder, lines=80)),
            "counts a",
        ),
    ],
)
def test_a_table_that_the_controller_cannot_run_is_refused_by_key(config: TableConfig, words: str) -> None:
    with pytest.raises(ConfigError, match=re.escape(words)):
        header_text(config, "a test")
