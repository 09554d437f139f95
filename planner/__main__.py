"""The planner's command line: `python -m planner COMMAND ...`."""

import argparse
import sys
from collections.abc import Sequence
from importlib import import_module

from planner.commands.command_line import parser
from planner.errors import PlannerError
from planner.kinematics.configuration import Configuration
from protocol.program.command_line import program_name
from protocol.program.ending import ended


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit status.

    0; 1 for a negative verdict; 2 for input that cannot be used; 128 and the number of the signal that ended it.
    """
    chosen = parser().read(arguments)
    name = f"{program_name('planner')} {chosen.command}"
    return ended(name, lambda: _status_of(chosen), PlannerError, interrupted="interrupted; nothing more was written")


def _status_of(chosen: argparse.Namespace) -> int:
    if getattr(chosen, "configuration", "all") not in {"all", "best"}:
        Configuration.parse(chosen.configuration)  # a misspelled name is refused before slow modules are loaded
    return int(import_module(f"planner.commands.{chosen.command.replace('-', '_')}").run(chosen))


if __name__ == "__main__":
    sys.exit(main())
