"""The planner's command line: `python -m planner COMMAND ...`."""

import argparse
import sys
from collections.abc import Sequence

from planner.commands import map as map_command
from planner.commands import plan as plan_command
from planner.commands import run as run_command
from planner.commands import scan as scan_command
from planner.commands import show as show_command
from planner.errors import PlannerError
from protocol.interrupts import ended_by_signals, said, status_after

_BAD_INPUT = 2


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit status.

    0; 1 for a negative verdict; 2 for input that cannot be used; 128 and the number of the signal that ended it.
    """
    parser = argparse.ArgumentParser(
        prog="python -m planner",
        description="Plan the motion of a rotary table under a scanning robot arm.",
        epilog="example: python -m planner map mould --out build/mould",
    )
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    map_command.add_parser(commands)
    plan_command.add_parser(commands)
    run_command.add_parser(commands)
    scan_command.add_parser(commands)
    show_command.add_parser(commands)
    chosen = parser.parse_args(arguments)
    with ended_by_signals() as ending:
        return ending.status(_status_of(chosen))


def _status_of(chosen: argparse.Namespace) -> int:
    try:
        return int(chosen.run(chosen))
    except PlannerError as error:
        print(error, file=sys.stderr)
        return _BAD_INPUT
    except KeyboardInterrupt as interrupt:
        print(f"\n{said(interrupt, 'interrupted')}; nothing more was written", file=sys.stderr)
        return status_after(interrupt)


if __name__ == "__main__":
    sys.exit(main())
