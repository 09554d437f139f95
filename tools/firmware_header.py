"""The constants of the compiled firmware: a C header made of a table's TOML file."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from emulator.avr.header import header_text
from emulator.avr.toolchain import CONSTANTS
from emulator.config.table_config import ConfigError, load_config
from protocol.files.whole_file import write_whole
from protocol.program.command_line import Parser, program_name
from protocol.program.ending import ended


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the header, and return the exit status."""
    options = parser().read(arguments)
    return ended("firmware_header", lambda: _run(options), ConfigError)


def _run(options: argparse.Namespace) -> int:
    source = "emulator/config/default.toml" if options.config is None else options.config.name
    write_whole(options.out, header_text(load_config(options.config), source))
    return 0


def parser() -> Parser:
    """Return the parser of the command line."""
    parser = Parser(
        prog=program_name("tools.firmware_header"),
        description="Write the constants of the compiled firmware as a C header.",
    )
    parser.add_argument(
        "--config", metavar="FILE", type=Path, help="TOML file of the table (default: the default table)"
    )
    parser.add_argument(
        "--out", metavar="FILE", type=Path, default=CONSTANTS, help="the header (default: that of the sources)"
    )
    return parser


if __name__ == "__main__":
    sys.exit(main())
