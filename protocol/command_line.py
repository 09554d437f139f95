"""The common part of all command lines of this project: the program's name, and a parser whose errors are one line.

An error has the form `PROGRAM: OBJECT: PROBLEM; allowed values; next step`, with status 2.
"""

import argparse
import shlex
import sys
from collections.abc import Sequence
from typing import Any, NoReturn

COMMAND = "seventh-axis"
"""The installed command that starts all programs."""

_names: list[str] = []
"""The name of this process, as `run_as` has set it; a process runs one program."""


def run_as(name: str) -> None:
    """Set the name that the next program shows in its help, such as `seventh-axis table`."""
    _names[:] = [name]


def program_name(module: str) -> str:
    """Return the command that runs a module: `python -m MODULE`, or the name that `run_as` has set."""
    return _names[0] if _names else f"python -m {module}"


class Parser(argparse.ArgumentParser):
    """A parser that accepts only full option names and reports an error in one line."""

    def __init__(self, *, allow_abbrev: bool = False, **settings: Any) -> None:  # noqa: ANN401  # those of argparse
        super().__init__(allow_abbrev=allow_abbrev, **settings)

    def read(self, arguments: Sequence[str] | None) -> argparse.Namespace:
        """Return the options of a command line, by default the program's. `command_line` holds all of its arguments."""
        words = sys.argv[1:] if arguments is None else list(arguments)
        options = self.parse_args(words)
        options.command_line = f"{self.prog} {shlex.join(words)}".rstrip()
        return options

    def error(self, message: str) -> NoReturn:
        """End the program with status 2."""
        self.exit(2, f"{short_name(self.prog)}: {message} (--help shows all options)\n")


def short_name(prog: str) -> str:
    """Return the name that starts a program's messages: `tune` for `python -m tools.tune`."""
    module, *words = prog.removeprefix("python -m ").split()
    return " ".join([module.rpartition(".")[2], *words])
