"""Identify a table: record a suitable motion over a port, and estimate the constants from a recording."""

import protocol.program.quiet_start  # noqa: F401 - before the slow imports

# isort: split
import argparse
import sys
from importlib import import_module
from pathlib import Path

from emulator.config.table_config import ConfigError
from protocol.errors import TableError
from protocol.program.command_line import Parser, program_name
from protocol.program.ending import ended
from tools.identification.errors import RecordingError

_EXAMPLES = """examples:
  {identify} record --port emulator:// --out trace.csv
  {identify} fit trace.csv --out table.toml
"""


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; return its exit status."""
    options = parser().read(arguments)
    return ended(program_name("tools.identify"), lambda: _run(options), ConfigError, RecordingError, TableError)


def _run(options: argparse.Namespace) -> int:
    commands = import_module("tools.identification.identify_commands")
    return int(getattr(commands, options.command)(options))


def parser() -> Parser:
    """Return the parser of the command line."""
    parser = Parser(
        prog=program_name("tools.identify"),
        description=__doc__,
        epilog=_EXAMPLES.format(identify=program_name("tools.identify")),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", dest="command", required=True)
    summary = "move a table and record its replies (by default within a quarter of a turn)"
    recorder = commands.add_parser("record", help=summary, description=summary)
    recorder.add_argument("--port", required=True, metavar="URL", help="/dev/ttyUSB0, socket://host:7000, emulator://")
    recorder.add_argument("--out", required=True, type=Path, metavar="FILE", help="CSV file to write")
    recorder.add_argument("--baud", type=int, default=9600, help="baud rate (default: 9600)")
    recorder.add_argument(
        "--duration", type=float, default=60.0, metavar="S", help="length of the recording (default: 60)"
    )
    recorder.add_argument("--speed", type=float, default=40.0, metavar="DEG_S", help="maximum speed (default: 40)")
    recorder.add_argument(
        "--acceleration", type=float, default=100.0, metavar="DEG_S2", help="maximum acceleration (default: 100)"
    )
    recorder.add_argument("--config", type=Path, help="known constants of the table: the tick rate of its controller")
    recorder.add_argument("--seed", type=int, default=0, help="random seed of the swings (default: 0)")
    summary = "estimate the constants of the recorded table"
    fitter = commands.add_parser("fit", help=summary, description=summary)
    fitter.add_argument("recording", type=Path, help="a CSV of `record`, of the emulator's trace, or of a drive")
    fitter.add_argument(
        "--out",
        required=True,
        type=Path,
        metavar="FILE",
        help="TOML file to write; the report is written to the same folder",
    )
    fitter.add_argument(
        "--config", type=Path, help="known constants: gains, encoder, datasheet (default: the default table)"
    )
    return parser


if __name__ == "__main__":
    sys.exit(main())
