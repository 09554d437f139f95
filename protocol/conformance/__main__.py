"""The command line of the conformance kit: `python -m protocol.conformance --port URL --out DIR`."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from protocol.bench import BenchError
from protocol.conformance.bench.ports import SessionError, open_port
from protocol.conformance.cases.case import Case
from protocol.conformance.cases.catalog import chosen_cases
from protocol.conformance.commands.command_line import UsageError, tell
from protocol.conformance.commands.replay_run import run_replay
from protocol.conformance.commands.suite_run import run_suite
from protocol.conformance.profile.profile import ProfileError, load_profile
from protocol.conformance.results.record import RecordError
from protocol.program.command_line import Parser, program_name
from protocol.program.ending import ended

_EXAMPLE = """examples:
  {conform} --port emulator:// --out build/conformance
  {conform} --port /dev/ttyUSB0 --profile table.toml --case 7 --case 4.2/3 --out record

Exit status: 0 when no case failed, 1 when one did, 2 when the table could not be tested, 130 after Ctrl-C
(and 128 and its number after another signal).
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit status."""
    options = parser().read(arguments)
    expected = UsageError, ProfileError, RecordError, SessionError, BenchError
    return ended(program_name("protocol.conformance"), lambda: _run(options), *expected)


def _run(options: argparse.Namespace) -> int:
    cases = _chosen(options.case)
    return _list(cases) if options.list else _on_the_table(options, cases)


def _on_the_table(options: argparse.Namespace, cases: Sequence[Case]) -> int:
    if not options.port or not (options.out or options.replay):
        raise UsageError("give --port URL and --out DIR, or --list (--help shows all options)")
    profile = load_profile(options.profile)
    port = open_port(options.port, profile)
    try:
        run = run_replay if options.replay else run_suite
        return run(options, profile, port, cases)
    finally:
        port.close()


def parser() -> Parser:
    """Return the parser of the command line."""
    parser = Parser(
        prog=program_name("protocol.conformance"),
        description="Test a rotary table against the specification, clause by clause.",
        epilog=_EXAMPLE.format(conform=program_name("protocol.conformance")),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = parser.add_argument
    add("--port", metavar="URL", help="the table: a device, or any URL of pyserial's")
    add(
        "--profile",
        metavar="FILE",
        type=Path,
        help="TOML file with the properties of the table (default: the emulator's)",
    )
    add(
        "--case",
        metavar="PREFIX",
        action="append",
        default=[],
        help="cases whose id starts with PREFIX ($ at the end: exact id); may be repeated",
    )
    add("--control", metavar="PATH", type=Path, help="control channel of a running emulator")
    add("--out", metavar="DIR", type=Path, help="output folder of record.json, report.html and junit.xml")
    add("--junit", metavar="FILE", type=Path, help="other file for the JUnit XML")
    add("--seed", metavar="N", type=int, default=0, help="random seed of the cases (default: 0)")
    add("--yes", action="store_true", help="move the table within the profile's limits without asking")
    add("--list", action="store_true", help="list the cases with their needs, and exit")
    add("--replay", metavar="FILE", type=Path, help="send the bytes of a record.json again, and list differing replies")
    return parser


def _chosen(prefixes: Sequence[str]) -> list[Case]:
    try:
        return chosen_cases(prefixes)
    except ValueError as error:
        raise UsageError(f"--case: {error}") from error


def _list(cases: Sequence[Case]) -> int:
    for case in cases:
        needs = f"  [needs {', '.join(sorted(case.needs))}]" if case.needs else ""
        turns = f"  [turns {case.travel_deg:g} deg]" if case.travel_deg else ""
        tell(f"{case.id:18} {case.clause.level:6} {case.clause.text}{turns}{needs}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
