"""Control a running emulator by its control channel: `python -m emulator.control_client PATH COMMAND`."""

import argparse
import json
import sys
from pathlib import Path

from emulator.server.control_commands import COMMANDS
from protocol.bench import BenchError
from protocol.control_channel import request
from protocol.program.command_line import Parser, program_name
from protocol.program.ending import ended

__all__ = ["main", "request"]

_MODULE = "emulator.control_client"
_EXAMPLE = """example:
  {table} --pty --control table.control
  {control} table.control trigger
  {control} table.control load-torque 0.3
"""


def main(arguments: list[str] | None = None) -> int:
    """Run the command line and return its exit status."""
    parsed = parser().parse_args(arguments)
    return ended(program_name(_MODULE), lambda: _request(parsed), BenchError)


def _request(parsed: argparse.Namespace) -> int:
    given = {parameter.name: getattr(parsed, parameter.name) for parameter in COMMANDS[parsed.command].parameters}
    parameters = {name: value for name, value in given.items() if value is not None}
    result = request(parsed.path, parsed.command, **parameters)
    if result:
        sys.stdout.write(json.dumps(result, indent=2) + "\n")
    return 0


def parser() -> Parser:
    """Return the parser of the command line."""
    parser = Parser(
        prog=program_name(_MODULE),
        description="Control a running emulator.",
        epilog=_EXAMPLE.format(table=program_name("emulator"), control=program_name(_MODULE)),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("path", metavar="PATH", type=Path, help="the socket of the emulator's option --control")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    for name, command in COMMANDS.items():
        subparser = commands.add_parser(name, help=command.help, description=command.help)
        for parameter in command.parameters:
            flag = "--" + parameter.name.replace("_", "-") if parameter.optional else parameter.name
            subparser.add_argument(flag, type=float, help=parameter.help)
    return parser


if __name__ == "__main__":
    sys.exit(main())
