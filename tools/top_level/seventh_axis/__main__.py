# PYTHON_ARGCOMPLETE_OK
"""The command `seventh-axis COMMAND ...`: one entry to all programs, which `python -m ...` runs too."""

import os
import sys
from collections.abc import Sequence
from importlib import import_module
from itertools import takewhile
from typing import TYPE_CHECKING, NamedTuple

from seventh_axis.home import HOME, hidden

if TYPE_CHECKING:
    from protocol.program.command_line import Parser

_BAD_INPUT = 2
_NAME = "seventh-axis"
_VERBOSE = {"-v", "--verbose"}


class Command(NamedTuple):
    """One command: the module with its `main` and its `parser`.

    `by_name`: the module has several commands, and parses its name itself.
    """

    module: str
    help: str
    by_name: bool = False


COMMANDS = {
    "table": Command("emulator.__main__", "run the emulator: a rotary table behind a virtual serial port"),
    "control": Command("emulator.control_client", "control a running emulator: trigger, state, faults"),
    "new-scan": Command("planner.__main__", "write a scan file for a mesh", by_name=True),
    "map": Command("planner.__main__", "compute and draw a scan's configuration map", by_name=True),
    "plan": Command("planner.__main__", "plan the table's motion along a scan", by_name=True),
    "run": Command("planner.__main__", "carry out a plan on a table, and verify the motion", by_name=True),
    "track": Command("planner.__main__", "plan the table while it moves, as locations become known", by_name=True),
    "scan": Command("planner.__main__", "scan a workpiece with a simulated probe", by_name=True),
    "show": Command("planner.__main__", "show a run as one HTML page", by_name=True),
    "conform": Command("protocol.conformance.__main__", "test a table against the specification"),
    "tune": Command("tools.tune", "tune the gains from the table's model"),
    "identify": Command("tools.identify", "record a table's motion, and estimate its constants"),
    "trace": Command("tools.plot_trace", "draw a trace that the emulator recorded"),
}
"""Every command besides `version`, in the order of the help."""

_EXAMPLES = """examples:
  seventh-axis table --pty --link ./table
  seventh-axis plan cylinder --out build/cylinder
  seventh-axis COMMAND --help

Exit status: 0 done; 1 a negative verdict; 2 input that cannot be used; 128 and its number after a signal.
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit status."""
    words = _name_first(sys.argv[1:] if arguments is None else arguments)
    command = COMMANDS.get(words[0] if words else "")
    for package in ("protocol", *([command.module.partition(".")[0]] if command else [])):
        if clash := hidden(package):
            sys.stderr.write(f"seventh-axis: {clash}\n")
            return _BAD_INPUT
    if "_ARGCOMPLETE" in os.environ:
        return _complete()
    if command is None:
        return _answer(words)
    import protocol.program.quiet_start  # noqa: F401, PLC0415  # before the slow imports
    from protocol.program.command_line import call_programs  # noqa: PLC0415  # see `seventh_axis`

    call_programs(program_names())
    return int(import_module(command.module).main(words if command.by_name else words[1:]))


def program_names() -> dict[str, str]:
    """Return what a user types for each module that is a program."""
    return {
        command.module.removesuffix(".__main__"): _NAME if command.by_name else f"{_NAME} {name}"
        for name, command in COMMANDS.items()
    }


def _name_first(words: Sequence[str]) -> list[str]:
    """Return a command line with the command's name first, also where -v stands before it."""
    leading = sum(1 for _ in takewhile(_VERBOSE.__contains__, words))
    return [*words[leading : leading + 1], *words[:leading], *words[leading + 1 :]]


def _answer(words: Sequence[str]) -> int:
    """Handle the options without a module: `version`, `--version`, `--help`, and errors."""
    options = _parser().parse_args(words)
    if options.command == "version":
        sys.stdout.write(_versions())
    return 0


def _parser() -> "Parser":
    from argparse import RawDescriptionHelpFormatter  # noqa: PLC0415  # a command needs another parser than this

    from protocol.program.command_line import Parser  # noqa: PLC0415  # see `seventh_axis`

    parser = Parser(
        prog=_NAME,
        description="A rotary table's emulator and its protocol, and a motion planner for a 7-axis laser scanner.",
        epilog=_EXAMPLES,
        formatter_class=RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"{_NAME} {_version()}")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", dest="command", required=True)
    for name, command in COMMANDS.items():
        commands.add_parser(name, help=command.help, add_help=False)
    commands.add_parser("version", help="show the versions of what is installed")
    return parser


def _versions() -> str:
    from protocol.program.extras import EXTRAS, is_installed  # noqa: PLC0415  # see `seventh_axis`

    extras = ", ".join(f"{extra} {'yes' if is_installed(extra) else 'no'}" for extra in EXTRAS)
    python = ".".join(map(str, sys.version_info[:3]))
    return f"seventh-axis {_version()} in {HOME}\nPython {python} on {sys.platform}\nextras installed: {extras}\n"


def _version() -> str:
    from importlib.metadata import PackageNotFoundError, version  # noqa: PLC0415  # most commands do not need it

    try:
        return version("seventh-axis")
    except PackageNotFoundError:
        return "unknown"


def _complete() -> int:
    """Print the possible completions for the shell. No command is run."""
    try:
        import argcomplete  # noqa: PLC0415  # an extra
    except ImportError:
        return _BAD_INPUT
    line = os.environ.get("COMP_LINE", "")
    typed = line[: int(os.environ.get("COMP_POINT", len(line)))].split(" ")
    command = COMMANDS.get(typed[1]) if len(typed) > 2 else None
    if command is None:
        argcomplete.autocomplete(_parser())
    else:
        if not command.by_name:  # argcomplete must start one word later
            os.environ["_ARGCOMPLETE"] = str(int(os.environ["_ARGCOMPLETE"]) + 1)
        argcomplete.autocomplete(import_module(command.module).parser())
    return _BAD_INPUT


if __name__ == "__main__":
    sys.exit(main())
