"""Build the compiled firmware of a table: `table.elf` and `table.hex`, with its size and its longest tick.

python -m tools.firmware --config table.toml --gains build/tune/gains.h --out build/firmware
"""

import argparse
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from shutil import copyfile

from emulator.avr.errors import ChipError, ToolchainError
from emulator.avr.header import CLOCK_HZ
from emulator.avr.toolchain import build_firmware
from emulator.config.table_config import ConfigError, TableConfig, load_config
from protocol.files.whole_file import whole_file
from protocol.program.command_line import Parser, program_name
from protocol.program.ending import ended
from tools.lockstep import PartingError, run_edges

FLASH_BYTES = 32 * 1024
RAM_BYTES = 2 * 1024
_TICKS = 3000
_EXPECTED = (ConfigError, ToolchainError, ChipError, PartingError)


def main(arguments: Sequence[str] | None = None) -> int:
    """Build the firmware, and return the exit status."""
    options = parser().read(arguments)
    return ended("firmware", lambda: _run(options), *_EXPECTED)


def parser() -> Parser:
    """Return the parser of the command line."""
    parser = Parser(
        prog=program_name("tools.firmware"),
        description="Build the firmware for an ATmega328P, and run it in simavr for its longest tick.",
    )
    add = parser.add_argument
    add("--config", metavar="FILE", type=Path, help="TOML file of the table (default: the default table)")
    add("--gains", metavar="FILE", type=Path, help="gains.h of tools.tune (default: the gains of the table)")
    add("--out", metavar="DIR", type=Path, default=Path("build/firmware"), help="output folder (default: %(default)s)")
    return parser


def _run(options: argparse.Namespace) -> int:
    config = load_config(options.config)
    built = build_firmware(config, gains=options.gains)
    lines = figures(config, built)  # first: a firmware that does not run in time is not written
    elf, hexadecimal = options.out / "table.elf", options.out / "table.hex"
    options.out.mkdir(parents=True, exist_ok=True)
    with whole_file(elf) as partial:
        copyfile(built, partial)
    with whole_file(hexadecimal) as partial:
        _run_tool("avr-objcopy", "-O", "ihex", str(elf), str(partial))
    print(*lines, f"firmware: {elf}", sep="\n")
    return 0


def figures(config: TableConfig, elf: Path) -> list[str]:
    """Return the limits of a firmware, its size, and its longest tick with a busy line.

    The rate of the edges is the maximum, in both directions.
    """
    flash, ram = sizes(elf)
    tick_cycles = CLOCK_HZ // config.control.tick_hz
    chip = run_edges(config, _TICKS, firmware=elf)
    return [
        f"limits {config.limits.speed_deg_s:g} deg/s and {config.limits.acceleration_deg_s2:g} deg/s^2",
        f"flash {flash} of {FLASH_BYTES} bytes ({flash / FLASH_BYTES:.0%})",
        f"RAM {ram + chip.stack_bytes} of {RAM_BYTES} bytes ({(ram + chip.stack_bytes) / RAM_BYTES:.0%}), "
        f"{chip.stack_bytes} of them stack",
        f"longest tick {chip.longest_tick} of {tick_cycles} cycles ({chip.longest_tick / tick_cycles:.0%})",
    ]


def sizes(elf: Path) -> tuple[int, int]:
    """Return the bytes of flash and of RAM that a firmware takes, without the stack."""
    output = _run_tool("avr-size", str(elf))
    text, data, bss = (int(word) for word in output.splitlines()[1].split()[:3])
    return text + data, data + bss


def _run_tool(*command: str) -> str:
    try:
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout
    except FileNotFoundError as error:
        raise ToolchainError(f"{command[0]} is not installed; install the package binutils-avr") from error
    except subprocess.CalledProcessError as error:
        raise ToolchainError(f"{command[0]} failed: {error.stderr.strip().splitlines()[-1]}") from error


if __name__ == "__main__":
    sys.exit(main())
