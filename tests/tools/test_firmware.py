"""`python -m tools.firmware` and `tools.firmware_header`: the firmware of a table, and its constants."""

import subprocess
from pathlib import Path
from shutil import which

import pytest

from emulator.avr.elf import read_program
from emulator.avr.header import header_text
from emulator.avr.toolchain import build_firmware
from emulator.config.table_config import load_config
from tests.emulator.avr.toolchain_mark import needs_toolchain
from tools.firmware import main
from tools.firmware_header import main as header_main

ROOT = Path(__file__).parents[2]


@needs_toolchain
def test_elf_and_hex_are_written_and_their_figures_printed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--out", str(tmp_path)]) == 0
    printed = capsys.readouterr().out
    assert printed.startswith("limits 40 deg/s and 100 deg/s^2\nflash ")
    assert "\nRAM " in printed
    assert "\nlongest tick " in printed
    flash = read_program((tmp_path / "table.elf").read_bytes()).flash
    lines = (tmp_path / "table.hex").read_text(encoding="ascii").split()
    data = b"".join(bytes.fromhex(line[9 : 9 + 2 * int(line[1:3], 16)]) for line in lines if line[7:9] == "00")
    assert data == flash
    assert {file.name for file in tmp_path.iterdir()} == {"table.elf", "table.hex"}


@needs_toolchain
def test_a_missing_tool_is_named_in_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    build_firmware(load_config())
    compiler = which("avr-gcc")
    assert compiler is not None
    (tmp_path / "avr-gcc").symlink_to(compiler)
    monkeypatch.setenv("PATH", str(tmp_path))
    assert main(["--out", str(tmp_path / "out")]) == 2
    assert capsys.readouterr().err == ("firmware: avr-size is not installed; install the package binutils-avr\n")


def make(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Ask make what it would run in a folder that is set up."""
    for name in ("pyproject.toml", "constraints.txt", ".venv/demo.stamp", "build/firmware/table.hex"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text("built", encoding="ascii")
    command = ["make", "-n", "-f", str(ROOT / "Makefile"), *arguments]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True)


@pytest.mark.skipif(which("make") is None, reason="make is not installed")
def test_flashing_never_builds_a_table_that_was_not_named(tmp_path: Path) -> None:
    plain = make(tmp_path, "flash", "PORT=p").stdout
    named = make(tmp_path, "flash", "PORT=p", "CONFIG=table.toml").stdout
    assert "tools.firmware" not in plain
    assert "avrdude" in plain
    assert named.index("tools.firmware --config table.toml") < named.index("avrdude")


@needs_toolchain
def test_tuned_gains_go_back_into_the_firmware(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from tools.tuning.gain_files import gains_header  # noqa: PLC0415  # it needs python-control, which takes a second

    config = load_config()
    from emulator.config.constants import firmware_constants  # noqa: PLC0415

    pid = firmware_constants(config).pid
    sets = {"ramp": pid.ramp._replace(proportional=pid.ramp.proportional + 1), "hold": pid.hold}
    (tmp_path / "gains.h").write_text(gains_header(config, sets), encoding="utf-8")
    flashes = []
    for name, options in (("own", []), ("tuned", ["--gains", str(tmp_path / "gains.h")])):
        assert main(["--out", str(tmp_path / name), *options]) == 0
        flashes.append((tmp_path / name / "table.elf").read_bytes())
    assert flashes[0] != flashes[1]
    capsys.readouterr()


def test_a_table_that_the_controller_cannot_run_is_one_line_and_status_2(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "table.toml").write_text("[control]\ntick_hz = 999\n", encoding="utf-8")
    for command in (main, header_main):
        assert command(["--config", str(tmp_path / "table.toml"), "--out", str(tmp_path / "out")]) == 2
        assert "control.tick_hz is 999" in capsys.readouterr().err


def test_the_header_of_a_table_is_written(tmp_path: Path) -> None:
    (tmp_path / "table.toml").write_text("[serial]\ndecimals = 2\n", encoding="utf-8")
    header = tmp_path / "constants.h"
    assert header_main(["--config", str(tmp_path / "table.toml"), "--out", str(header)]) == 0
    config = load_config(tmp_path / "table.toml")
    assert header.read_text(encoding="ascii") == header_text(config, "table.toml")
