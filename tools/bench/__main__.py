"""Benchmarks: every figure is compared with a reference that runs in the same minute on the same machine.

python -m tools.bench emulator map
python -m tools.bench identify --pty
"""

import argparse
import sys
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from pathlib import Path

from protocol.program.command_line import Parser, program_name
from protocol.program.ending import ended

SUBJECTS = (
    "adaptive", "avr", "calibration", "emulator", "identify", "map", "planner", "scan", "stop", "stream", "track",
)  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the named benchmarks and print their tables."""
    options = parser().parse_args(arguments)
    # Each benchmark needs libraries that the others do not. An interrupt must not occur during the import of compiled
    # ones.
    benches = {subject: import_module(f"tools.bench.{subject}").bench for subject in options.subject}
    return ended("bench", lambda: _run(options, benches))


def _run(options: argparse.Namespace, benches: Mapping[str, Callable[..., None]]) -> int:
    for subject, bench in benches.items():
        if subject == "identify":
            bench(sys.stdout, options.plants, options.seed, options.jobs, options.pty, options.wide)
        elif subject == "adaptive":
            bench(sys.stdout, tuple(options.scan))
        elif subject == "track":
            bench(sys.stdout, options.pty, options.plot)
        elif subject == "avr":
            bench(sys.stdout, options.ticks, options.lines, options.seed)
        else:
            bench(sys.stdout)
    return 0


def parser() -> Parser:
    """Return the parser of the command line."""
    parser = Parser(
        prog=program_name("tools.bench"),
        description="Measure this machine's figures, compared with a reference.",
        epilog="examples:\n  python -m tools.bench emulator map\n  python -m tools.bench identify --pty",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("subject", choices=SUBJECTS, nargs="+", help=f"what is measured, of {', '.join(SUBJECTS)}")
    adaptive = parser.add_argument_group("for adaptive")
    adaptive.add_argument(
        "--scan", metavar="SCAN", action="append", default=[], help="a scan file (default: all shipped scans)"
    )
    parser.add_argument("--plot", type=Path, metavar="FILE", help="for track: picture of cost and pauses over the view")
    identify = parser.add_argument_group("for identify")
    parser.add_argument(
        "--pty", action="store_true", help="for identify and track: in real time, minutes on a quiet machine"
    )
    identify.add_argument(
        "--wide", action="store_true", help="a wider family of tables, and the default table with seeds 0 to 19"
    )
    identify.add_argument(
        "--plants", metavar="N", type=int, help="number of random tables (default: 10; with --wide 40)"
    )
    identify.add_argument(
        "--seed", metavar="N", type=int, default=1, help="of the first table, or of the client of avr (default 1)"
    )
    identify.add_argument("--jobs", metavar="N", type=int, default=2, help="tables at once (default 2)")
    avr = parser.add_argument_group("for avr")
    avr.add_argument("--ticks", metavar="N", type=int, default=10_000_000, help="in lockstep (default: %(default)s)")
    avr.add_argument("--lines", metavar="N", type=int, default=100_000, help="of fuzzing (default: %(default)s)")
    return parser


if __name__ == "__main__":
    sys.exit(main())
