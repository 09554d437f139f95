from dataclasses import replace
from pathlib import Path

import pytest

from emulator.config.table_config import ConfigError, load_config
from tools.tuning.given_gains import given_gains

CONFIG = load_config()
HOLD = "[gains.hold]\nproportional_duty_s_deg = 0.012\n"
HEAVY = "[table]\ninertia_kg_m2 = 0.6\n"
HEAVY_RAMP = HEAVY + "[gains.ramp]\nintegral_time_s = 0.02\n"


@pytest.fixture
def gains(tmp_path: Path) -> Path:
    return tmp_path / "gains.toml"


def test_a_file_of_gains_alone_is_for_the_default_table(gains: Path) -> None:
    gains.write_text(HOLD, encoding="utf-8")

    config, given = given_gains(gains, None)

    assert config == CONFIG
    assert given.ramp == CONFIG.gains.ramp
    assert given.hold == replace(CONFIG.gains.hold, proportional_duty_s_deg=0.012)


def test_a_file_may_describe_its_table_too(gains: Path) -> None:
    gains.write_text(HEAVY + HOLD, encoding="utf-8")

    config, given = given_gains(gains, None)

    assert config.table.inertia_kg_m2 == 0.6
    assert config.gains == CONFIG.gains
    assert given.hold.proportional_duty_s_deg == 0.012


@pytest.mark.parametrize("text", [HOLD, HEAVY + HOLD], ids=["gains alone", "the same table"])
def test_what_a_file_leaves_out_is_as_the_configuration_has_it(text: str, gains: Path, tmp_path: Path) -> None:
    gains.write_text(text, encoding="utf-8")
    table = tmp_path / "table.toml"
    table.write_text(HEAVY_RAMP, encoding="utf-8")

    config, given = given_gains(gains, table)

    assert config == load_config(table)
    assert given.ramp.integral_time_s == 0.02
    assert given.hold.proportional_duty_s_deg == 0.012


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        (HEAVY, "gains.toml: no gains; add .gains.ramp. or .gains.hold."),
        ("[gains]\n", "gains.toml: no gains; add"),
        ("[gains.hold]\nproportional = 1\n", "gains.hold.proportional is not a known key"),
        ("[gains.hold]\nintegral_time_s = 0\n", "gains.hold.integral_time_s is 0; it must be a finite number at least"),
        ("[gains.hold]\nproportional_duty_s_deg = 0\n", "does not fit the firmware"),
        ("[table]\ninertia_kg_m2 = 0.7\n" + HOLD, "gains.toml: its table is not that of .*table.toml; keep only"),
    ],
)
def test_gains_that_cannot_be_judged_are_refused(text: str, complaint: str, gains: Path, tmp_path: Path) -> None:
    gains.write_text(text, encoding="utf-8")
    table = tmp_path / "table.toml"
    table.write_text(HEAVY, encoding="utf-8")

    with pytest.raises(ConfigError, match=complaint):
        given_gains(gains, table)
