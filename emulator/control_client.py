"""Talk to the control channel of a running stand-in: `python -m emulator.control_client PATH COMMAND`."""

import argparse
import json
import socket
import sys
from pathlib import Path
from typing import Any

from emulator.server.control_commands import COMMANDS, RequestError, parsed_line

_TIMEOUT_S = 5.0
_LONGEST_ANSWER = 1 << 16
_EXAMPLE = """example:
  python -m emulator --pty --control table.control
  python -m emulator.control_client table.control trigger
  python -m emulator.control_client table.control load-torque 0.3
"""


class ControlError(Exception):
    """The stand-in cannot be reached, or refused the request; the message says why."""


def request(path: Path, command: str, **parameters: float) -> dict[str, Any]:
    """Return the answer to one command.

    Raises:
        ControlError: nobody listens at `path`, something else answers there, or the request is refused.
    """
    line = json.dumps({"command": command, **parameters}).encode() + b"\n"
    try:
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as connection:
            connection.settimeout(_TIMEOUT_S)
            connection.connect(str(path))
            connection.sendall(line)
            with connection.makefile("rb") as replies:
                reply = replies.readline(_LONGEST_ANSWER)
    except OSError as error:
        raise ControlError(f"{path}: {error}; start an emulator with --control {path}") from error
    if not reply:
        raise ControlError(f"{path}: the stand-in hung up without an answer")
    result = _result(reply)
    if result is None:
        raise ControlError(f"{path}: {reply[:80]!r} is no answer of a stand-in; is this its control channel?")
    if not result.pop("ok", False):
        raise ControlError(str(result["error"]))
    return result


def _result(reply: bytes) -> dict[str, Any] | None:
    """Return an answer's fields, or None where it is none."""
    try:
        fields = parsed_line(reply)
    except RequestError:
        return None
    return fields if isinstance(fields, dict) and ("error" in fields or fields.get("ok") is True) else None


def main(arguments: list[str] | None = None) -> int:
    """Run the command line and return its exit status."""
    parsed = _parser().parse_args(arguments)
    given = {parameter.name: getattr(parsed, parameter.name) for parameter in COMMANDS[parsed.command].parameters}
    parameters = {name: value for name, value in given.items() if value is not None}
    try:
        result = request(parsed.path, parsed.command, **parameters)
    except ControlError as error:
        sys.stderr.write(f"control_client: {error}\n")
        return 2
    if result:
        sys.stdout.write(json.dumps(result, indent=2) + "\n")
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m emulator.control_client",
        description="Act on a running stand-in apart from the wire.",
        epilog=_EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("path", metavar="PATH", type=Path, help="the socket that the stand-in was given with --control")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    for name, command in COMMANDS.items():
        subparser = commands.add_parser(name, help=command.help, description=command.help)
        for parameter in command.parameters:
            flag = "--" + parameter.name.replace("_", "-") if parameter.optional else parameter.name
            subparser.add_argument(flag, type=float, help=parameter.help)
    return parser


if __name__ == "__main__":
    sys.exit(main())
