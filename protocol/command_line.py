"""What every command line of this project has in common: its name, and a parser whose errors are one line.

An error is `PROGRAM: OBJECT: PROBLEM; what is allowed; what to do`, and status 2.
"""

import argparse
import shlex
import sys
from collections.abc import Sequence
from typing import Any, NoReturn

COMMAND = "seventh-axis"
"""The installed command that leads to all programs."""

_names: list[str] = []
"""What this process was started as, once `run_as` has been told; a process runs one program."""


def run_as(name: str) -> None:
    """Let the program that runs next call itself so in its help, such as `seventh-axis table`."""
    _names[:] = [name]


def program_name(module: str) -> str:
    """Return what a user types to run a module: `python -m MODULE`, unless `run_as` has named it."""
    return _names[0] if _names else f"python -m {module}"


class Parser(argparse.ArgumentParser):
    """A parser that takes options by their full names only, and refuses a command line in one line."""

    def __init__(self, *, allow_abbrev: bool = False, **settings: Any) -> None:  # noqa: ANN401  # those of argparse
        super().__init__(allow_abbrev=allow_abbrev, **settings)

    def read(self, arguments: Sequence[str] | None) -> argparse.Namespace:
        """Return the options of a command line, by default the program's; `command_line` is the whole of it."""
        words = sys.argv[1:] if arguments is None else list(arguments)
        options = self.parse_args(words)
        options.command_line = f"{self.prog} {shlex.join(words)}".rstrip()
        return options

    def error(self, message: str) -> NoReturn:
        """End the program with status 2."""
        self.exit(2, f"{short_name(self.prog)}: {message} (--help shows all options)\n")


def short_name(prog: str) -> str:
    """Return a program's name as its messages begin with it: `tune` for `python -m tools.tune`."""
    module, *words = prog.removeprefix("python -m ").split()
    return " ".join([module.rpartition(".")[2], *words])
