import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest

from emulator.config.constants import fixed_gains
from emulator.config.table_config import TableConfig, load_config
from emulator.firmware.pid import Gains
from tools.emulated import with_gains
from tools.tuning.gain_files import gains_config, gains_header, gains_toml

CONFIG = load_config()
OTHER = replace(
    CONFIG,
    gears=replace(CONFIG.gears, ratio=250.5),
    table=replace(CONFIG.table, inertia_kg_m2=1.25e-5),
    driver=replace(CONFIG.driver, pwm_bits=8),
    serial=replace(CONFIG.serial, strict=True),
)
SETS = {"ramp": Gains(15288, 38461, 19273), "hold": Gains(70000, 1, 0)}
WIDEST = Gains(2**31 - 1, 2**31 - 1, 2**31 - 1)


@pytest.mark.parametrize("config", [CONFIG, OTHER], ids=["default table", "another table"])
def test_the_configuration_gives_back_the_table_and_the_registers(config: TableConfig, tmp_path: Path) -> None:
    tuned = with_gains(config, *(gains_config(config, gains) for gains in SETS.values()))
    path = tmp_path / "gains.toml"
    path.write_text(gains_toml(tuned), encoding="utf-8")

    read = load_config(path)

    assert read == tuned
    assert fixed_gains(read, read.gains.ramp) == SETS["ramp"]
    assert fixed_gains(read, read.gains.hold) == SETS["hold"]


def test_the_configuration_states_nothing_else_of_a_default_table() -> None:
    assert re.findall(r"^\[(.*)\]", gains_toml(CONFIG), re.MULTILINE) == ["gains.ramp", "gains.hold"]


def test_gains_that_the_configuration_cannot_state_are_misuse() -> None:
    with pytest.raises(ValueError, match="no proportional gain"):
        gains_config(CONFIG, Gains(0, 1, 0))


@pytest.mark.skipif(not shutil.which("gcc"), reason="there is no gcc to compile the header with")
def test_the_header_compiles_without_a_warning_and_holds_the_registers(tmp_path: Path) -> None:
    """As on a small controller, `long` has 32 bits: each gain must be one and fit an int32_t."""
    (tmp_path / "gains.h").write_text(gains_header(OTHER, SETS | {"widest": WIDEST}), encoding="ascii")
    names = [
        f"GAINS_{name}_{key}"
        for name in ("RAMP", "HOLD", "WIDEST")
        for key in ("PROPORTIONAL", "INTEGRAL", "DERIVATIVE")
    ]
    names += ["GAINS_TICK_HZ", "GAINS_SPEED_WINDOW_TICKS", "GAINS_DUTY_MAX"]
    program = tmp_path / "main.c"
    program.write_text(
        '#include <stdint.h>\n#include <stdio.h>\n#include "gains.h"\n#include "gains.h"\n'
        f"static const int32_t gains[] = {{{', '.join(names)}}};\n"
        "static const uint8_t bits[] = {GAIN_FRACTION_BITS, INTEGRAL_GAIN_FRACTION_BITS};\n"
        "int main(void) {\n"
        f'  for (int i = 0; i < {len(names)}; i++) printf("%ld ", (long)gains[i]);\n'
        '  return printf("%d %d\\n", bits[0], bits[1]) < 0;\n}\n',
        encoding="ascii",
    )

    strict = ["-std=c99", "-Wall", "-Wextra", "-pedantic", "-Wconversion", "-Werror"]
    subprocess.run(["gcc", *strict, "-o", tmp_path / "main", program], check=True)
    printed = subprocess.run([tmp_path / "main"], check=True, capture_output=True, text=True).stdout

    values = [value for gains in (*SETS.values(), WIDEST) for value in gains]
    assert [int(word) for word in printed.split()] == [*values, 1000, 8, 255, 12, 16]
