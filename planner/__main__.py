"""The planner's command line: `python -m planner COMMAND ...`."""

import argparse
import sys
from collections.abc import Sequence
from importlib import import_module

from planner.commands.command_line import parser
from planner.errors import PlannerError
from planner.kinematics.configuration import Configuration
from protocol.command_line import program_name, short_name
from protocol.interrupts import ended_by_signals, said, status_after

_BAD_INPUT = 2


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit status.

    0; 1 for a negative verdict; 2 for input that cannot be used; 128 and the number of the signal that ended it.
    """
    chosen = parser().read(arguments)
    with ended_by_signals() as ending:
        return ending.status(_status_of(chosen))


def _status_of(chosen: argparse.Namespace) -> int:
    name = short_name(f"{program_name('planner')} {chosen.command}")
    try:
        if getattr(chosen, "configuration", "all") not in {"all", "best"}:
            Configuration.parse(chosen.configuration)  # a misspelt name is refused before what takes long is loaded
        return int(import_module(f"planner.commands.{chosen.command.replace('-', '_')}").run(chosen))
    except PlannerError as error:
        print(f"{name}: {error}", file=sys.stderr)
        return _BAD_INPUT
    except KeyboardInterrupt as interrupt:
        print(f"\n{name}: {said(interrupt, 'interrupted')}; nothing more was written", file=sys.stderr)
        return status_after(interrupt)


if __name__ == "__main__":
    sys.exit(main())
