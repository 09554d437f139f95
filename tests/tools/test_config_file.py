from dataclasses import replace
from pathlib import Path

import pytest

from emulator.config.table_config import TableConfig, load_config
from tools.config_file import config_toml

CONFIG = load_config()
OTHER = replace(
    CONFIG,
    gears=replace(CONFIG.gears, ratio=240.0),
    table=replace(CONFIG.table, inertia_kg_m2=0.1 + 0.2, bearing_friction_Nm=1e-7),
    gains=replace(CONFIG.gains, hold=replace(CONFIG.gains.hold, derivative_time_s=0.0)),
    serial=replace(CONFIG.serial, baud=0, strict=True),
)


@pytest.mark.parametrize("config", [CONFIG, OTHER], ids=["default table", "another table"])
def test_a_written_table_is_read_back_to_the_last_digit(config: TableConfig, tmp_path: Path) -> None:
    path = tmp_path / "table.toml"
    path.write_text(config_toml(config, "Of a test,\nin two lines."), encoding="utf-8")

    assert load_config(path) == config


def test_only_what_differs_is_written_and_what_is_asked_for() -> None:
    text = config_toml(OTHER, "Of a test.", always=frozenset({"motor.resistance_ohm", "gears.ratio"}))

    assert text == (
        "# Of a test.\n\n[motor]\nresistance_ohm = 2.18\n\n[gears]\nratio = 240.0\n\n[table]\n"
        "inertia_kg_m2 = 0.30000000000000004\nbearing_friction_Nm = 1e-07\n\n[gains.hold]\nderivative_time_s = 0.0\n\n"
        "[serial]\nbaud = 0\nstrict = true\n"
    )
