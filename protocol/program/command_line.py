"""What every command line of this project has in common: its name, its parser, and how it reports an error.

An error has the form `PROGRAM: OBJECT: PROBLEM; allowed values; next step`, with status 2.
"""

import argparse
import os
import re
import shlex
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, NoReturn

from protocol.program.color import colored

_names: dict[str, str] = {}
"""What a user types for each module; empty where that is `python -m MODULE`."""


def call_programs(names: Mapping[str, str]) -> None:
    """Let help and messages name programs as the user starts them, such as `seventh-axis table` for `emulator`."""
    _names.clear()
    _names.update(names)


def program_name(module: str) -> str:
    """Return what a user types to run a module: `python -m MODULE`, or what `call_programs` has named it."""
    return _names.get(module, f"python -m {module}")


def short_name(prog: str) -> str:
    """Return a program's name as its messages begin with it: `tune` for `python -m tools.tune`."""
    module, *words = prog.removeprefix("python -m ").split()
    return " ".join([module.rpartition(".")[2], *words])


def report(prog: str, sentence: str) -> None:
    """Print a sentence of a program on stderr."""
    _print_on_stderr(f"{short_name(prog)}: {sentence}\n")


def report_error(prog: str, problem: str) -> None:
    """Print on stderr in one line what ends a program."""
    _print_on_stderr(_error_line(prog, problem))


class Parser(argparse.ArgumentParser):
    """A parser that accepts only full option names and reports an error in one line."""

    def __init__(self, *, allow_abbrev: bool = False, **settings: Any) -> None:  # noqa: ANN401  # those of argparse
        super().__init__(allow_abbrev=allow_abbrev, **settings)
        self.add_argument(
            "-v",
            "--verbose",
            action=_Verbose,
            nargs=0,
            dest=argparse.SUPPRESS,
            default=argparse.SUPPRESS,
            help="print debug messages on stderr",
        )

    def read(self, arguments: Sequence[str] | None) -> argparse.Namespace:
        """Return the options of a command line, by default the program's. `command_line` holds all of its arguments."""
        words = sys.argv[1:] if arguments is None else list(arguments)
        options = self.parse_args(words)
        options.command_line = f"{self.prog} {shlex.join(words)}".rstrip()
        return options

    def error(self, message: str) -> NoReturn:
        """End the program with status 2."""
        self.exit(2, _error_line(self.prog, f"{_reworded(message)} (--help shows all options)"))

    def _check_value(self, action: argparse.Action, value: Any) -> None:  # noqa: ANN401  # as argparse has it
        """Refuse a value that is not one of the choices."""
        from protocol.files.data_file import did_you_mean  # noqa: PLC0415  # rarely needed, and a start should be quick

        if action.choices is not None and value not in action.choices:
            names = [str(choice) for choice in action.choices]
            raise argparse.ArgumentError(
                action, f"is {value}; allowed are {', '.join(names)}{did_you_mean(str(value), names)}"
            )


class _Verbose(argparse.Action):
    """Begins at once: the option may stand before or after the name of a command."""

    def __call__(self, *_: object) -> None:
        from protocol.program.verbose import log_to_stderr  # noqa: PLC0415  # rarely asked for, and a start should be quick

        log_to_stderr()


def _print_on_stderr(line: str) -> None:
    """Print a line; when nobody reads any more, the work goes on."""
    if sys.stderr is None:
        return
    try:
        sys.stderr.write(line)
        sys.stderr.flush()
    except OSError:  # what is left in the buffer would fail once more when Python ends
        with suppress(OSError, ValueError), Path(os.devnull).open("w", encoding="ascii") as nobody:
            os.dup2(nobody.fileno(), sys.stderr.fileno())


def _error_line(prog: str, problem: str) -> str:
    return f"{colored(f'{short_name(prog)}:', 'bad', sys.stderr)} {problem}\n"


def _reworded(message: str) -> str:
    """Return a message of argparse in the form `OBJECT: PROBLEM; what is allowed`."""
    message = message.removeprefix("argument ")
    for kind, allowed in (("float", "a number"), ("int", "a whole number")):
        message = re.sub(rf"invalid {kind} value: '(.*)'", rf"is \1; allowed is {allowed}", message)
    return message
