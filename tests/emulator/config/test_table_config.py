"""The configuration: every default exists, and errors name the file, the key and the allowed values."""

import math
import tomllib
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from emulator.config.table_config import DEFAULT_FILE, ConfigError, TableConfig, load_config
from emulator.table.table import Table

DEFAULTS = tomllib.loads(DEFAULT_FILE.read_text(encoding="utf-8"))


def leaves(section: Any, where: str = "") -> dict[str, Any]:  # noqa: ANN401  # a table of TOML, or a section's value
    """Return each number of a section under its dotted key."""
    if is_dataclass(section):
        section = {entry.name: getattr(section, entry.name) for entry in fields(section) if entry.name != "faults"}
    found: dict[str, Any] = {}
    for key, value in section.items():
        deeper = isinstance(value, dict) or is_dataclass(value)
        found |= leaves(value, f"{where}{key}.") if deeper else {f"{where}{key}": value}
    return found


def loaded(directory: Path, text: str) -> TableConfig:
    path = directory / "table.toml"
    path.write_text(text, encoding="utf-8")
    return load_config(path)


def toml(key: str, value: object) -> str:
    section, _, name = key.rpartition(".")
    return f"[{section}]\n{name} = {value}\n"


def test_the_shipped_file_holds_every_constant_and_no_other() -> None:
    assert leaves(load_config()) == leaves(DEFAULTS)


def test_a_file_changes_what_it_names_and_nothing_else(tmp_path: Path) -> None:
    config = loaded(tmp_path, "[gains.hold]\nintegral_time_s = 1\n[serial]\nbaud = 115200\n")
    changed = {"gains.hold.integral_time_s": 1.0, "serial.baud": 115200}
    assert leaves(config) == leaves(DEFAULTS) | changed
    assert isinstance(config.gains.hold.integral_time_s, float)


def test_an_empty_file_is_the_default_table(tmp_path: Path) -> None:
    assert loaded(tmp_path, "") == load_config()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("nonsense = 1", r"nonsense is not a known key; known are control, driver, .*, table"),
        ("[motor]\nR = 1", r"motor\.R is not a known key; known are inductance_H, "),
        ("[gains.hold]\nkp = 1", r"gains\.hold\.kp is not a known key; known are derivative_time_s, "),
        ("motor = 3", r"motor is 3; it must be a table"),
        ("[motor.resistance_ohm]\nx = 1", r"motor\.resistance_ohm is \{'x': 1\}; it must be a finite number"),
        ('[motor]\nresistance_ohm = "2 ohm"', r"motor\.resistance_ohm is '2 ohm'; it must be a finite number"),
        ("[motor]\nresistance_ohm = true", r"motor\.resistance_ohm is True; it must be a finite number"),
        ("[encoder]\nlines = 96.0", r"encoder\.lines is 96\.0; it must be a whole number"),
        ("[serial]\nstrict = 1", r"serial\.strict is 1; it must be true or false"),
        ("[motor]\nresistance_ohm = nan", r"motor\.resistance_ohm is nan; it must be a finite number"),
        ("[motor]\nresistance_ohm = inf", r"motor\.resistance_ohm is inf; it must be a finite number"),
        (
            "[motor]\nresistance_ohm = -2.18",
            r"motor\.resistance_ohm is -2\.18; it must be a finite number at least 0\.001",
        ),
        (
            "[motor]\ninductance_H = 1e-310",
            r"motor\.inductance_H is 1e-310; it must be a finite number at least 1e-06 and at most 10",
        ),
        (
            f"[motor]\nresistance_ohm = 1{'0' * 400}",
            r"motor\.resistance_ohm is 10+\.\.\.; it must be .* at most 10000",
        ),
        ("[driver]\nsupply_V = 0", r"driver\.supply_V is 0; it must be a finite number above 0"),
        ("[driver]\npwm_bits = 12", r"driver\.pwm_bits is 12; it must be a whole number from 4 to 11"),
        ("[gears]\nefficiency = 1.1", r"gears\.efficiency is 1\.1; it must be .* at most 1"),
        ("[serial]\ndecimals = 0", r"serial\.decimals is 0; it must be a whole number from 1 to 6"),
        ("[power_on]\nspeed_deg_s = 41", r"power_on\.speed_deg_s is 41; it must be at most limits\.speed_deg_s, 40"),
        (
            "[power_on]\nspeed_deg_s = 1e-9",
            r"power_on\.speed_deg_s is 1e-09; .* holds at least 2\.9\S*; .* encoder\.lines",
        ),
        (
            "[power_on]\nacceleration_deg_s2 = 1e-6",
            r"acceleration_deg_s2 is 1e-06; .* holds at least 2\.9\S*; .* a lower control\.tick_hz",
        ),
        (
            "[limits]\nspeed_deg_s = 6e5",
            r"limits\.speed_deg_s is 600000; .* holds at most 512000; .* a shorter control\.speed_window_ticks",
        ),
        (
            "[limits]\nacceleration_deg_s2 = 1e9\n[control]\ntick_hz = 500",
            r"limits\.acceleration_deg_s2 is 1e\+09; .* holds at most 5\.1\S*; .* a higher control\.tick_hz",
        ),
        ("[settling]\napproach_speed_deg_s = 1e-9", r"approach_speed_deg_s is 1e-09; .* holds at least 2\.9"),
        ("[gears]\nratio = 480.1234567", r"is 480\.1234567; .* 32 bits.*; the nearest allowed ratio is \"\d+/\d+\""),
        ("[gears]\nratio = 81.37037037037", r"is 81\.37037037037; .*; the nearest allowed ratio is \"2197/27\""),
        (
            "[gears]\nratio = '2197:27'",
            r"is '2197:27'; it must be a finite number, or a fraction such as \"7/3\", at least 1",
        ),
        ("[gears]\nratio = '2197/0'", r"is '2197/0'; it must be a finite number, or a fraction"),
        ("[gears]\nratio = '1/2'", r"gears\.ratio is '1/2'; it must be .* at least 1"),
        (
            "[gears]\nratio = 1e5\n[encoder]\nlines = 9000",
            r"a turn is 3\.6e\+09 counts; it must be at most 2147483647; ",
        ),
        ("[control]\nspeed_window_ticks = 257", r"speed_window_ticks is 257; it must be a whole number from 1 to 256"),
        ("motor = [", r"is not TOML: "),
        (f"[encoder]\nlines = {'9' * 5000}", r"is not TOML: "),
        (
            f"[encoder]\nlines = 0x{'f' * 5000}",
            r"encoder\.lines is a very long int; it must be a whole number from",
        ),
        (f"motor = 0x{'f' * 5000}", r"motor is a very long int; it must be a table"),
        (f"motor = [0x{'f' * 5000}]", r"motor is a very long list; it must be a table"),
        (f"faults = [0x{'f' * 5000}]", r"faults is a very long list; it must be a list of tables"),
        (f"[[faults]]\nfault = 'drop'\nprobability = 0x{'f' * 5000}", r"probability is a very long int"),
        (f"motor = {'[' * 300}{']' * 300}", r"motor is \[\[.*; it must be a table"),
        (f"motor = {'[' * 900}{']' * 900}", r"nested too deeply|it must be a table"),
        (f"motor = {'[' * 5000}{']' * 5000}", r"nested too deeply"),
        (f"motor = {'{a=' * 900}1{'}' * 900}", r"nested too deeply|must be a table|a is not a known key"),
        (f"[{'a.' * 5000}a]", r"is not a known key|nested too deeply"),
        (f"'{'k' * 5000}' = 1", r"k\.\.\. is not a known key"),
        (f"# {'x' * (1 << 20)}", r"is larger than 1 MB"),
        ("[motor]\nresistance_ohm = 2026-11-28", r"resistance_ohm is datetime.*; it must be a finite number"),
    ],
)
def test_what_cannot_be_used_is_refused_in_one_line(text: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=message) as refused:
        loaded(tmp_path, text)
    assert str(refused.value).startswith(f"{tmp_path / 'table.toml'}: ")
    assert "\n" not in str(refused.value)
    assert len(str(refused.value)) < 1000


def test_a_file_that_cannot_be_read_is_refused_by_its_name(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"missing\.toml: cannot be read"):
        load_config(tmp_path / "missing.toml")
    (tmp_path / "latin1.toml").write_bytes(b"# \xe9")
    with pytest.raises(ConfigError, match=r"latin1\.toml: cannot be read"):
        load_config(tmp_path / "latin1.toml")


@settings(max_examples=150, deadline=None)
@given(
    key=st.sampled_from(sorted(set(leaves(DEFAULTS)) - {"serial.strict"})),
    value=st.floats(0, 100)
    | st.sampled_from([0, 1, -1, 0.01, 1e-9, 1e-6, 5e-324, 1e9, 1e308, 10**400, math.inf, math.nan]),
)
def test_a_table_is_refused_or_it_runs(key: str, value: float, tmp_path_factory: pytest.TempPathFactory) -> None:
    """No number in any place crashes the emulator or makes it hang."""
    try:
        table = Table(loaded(tmp_path_factory.getbasetemp(), toml(key, value)).with_serial(baud=0))
    except ConfigError:
        return
    table.receive(b"R 1\r")
    table.advance(30)
    assert table.transmit() in {b"OK\r", b"ERR 3 out of range\r"}


def test_serial_settings_are_changed_by_name_and_none_keeps_them() -> None:
    config = load_config().with_serial(baud=115200, decimals=None, strict=True)
    assert (config.serial.baud, config.serial.decimals, config.serial.strict) == (115200, 1, True)
    with pytest.raises(ConfigError, match=r"serial settings: serial\.decimals is 7; it must be .* from 1 to 6"):
        load_config().with_serial(decimals=7)


def test_the_default_table_has_512_counts_a_degree() -> None:
    assert load_config().counts_per_turn == 360 * 512


def test_a_gain_that_no_register_holds_is_refused_with_file_and_key(tmp_path: Path) -> None:
    file = tmp_path / "table.toml"
    file.write_text("[gains.ramp]\nproportional_duty_s_deg = 1e6\n", encoding="utf-8")
    with pytest.raises(ConfigError, match=r"table\.toml: gains\.ramp: .* does not fit the firmware"):
        load_config(file)
