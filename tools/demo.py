"""The main job, on real input: `python -m tools.demo --out DIR`.

Plans the shipped scan of a cylinder, starts an emulator on a pty as a separate program, and streams the plan to it.
Then it verifies from the readings that the motion was as planned, and prints the name of the report. `python -m
tools.demo preemption --out DIR` draws Fig. 4 of the paper instead.
"""

import protocol.program.quiet_start  # noqa: F401 - before the slow imports

# isort: split
import argparse
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from planner.__main__ import main as planner
from planner.defaults import REPORT_FILE
from protocol import TableError
from protocol.program.command_line import Parser, program_name
from protocol.program.ending import ended

SCAN = "cylinder"
FAST = 3.0
"""Time scale of the emulator, so that a scan of 47 s is short."""
_NOT_VERIFIED = (1, 2)
"""Exit statuses of a run for which this machine may be too slow."""
LEAD_S = 0.0035
"""Lag of the emulator's encoder behind its reference."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the demonstration and return the exit status: 0 when the motion was verified."""
    options = parser().parse_args(arguments)
    return ended(program_name("tools.demo"), lambda: _run(options), TableError)


def parser() -> Parser:
    """Return the parser of the command line."""
    parser = Parser(
        prog=program_name("tools.demo"),
        description="Plan a scan, stream it to an emulator on a pseudo-terminal, and verify the motion.",
        epilog=f"example: {program_name('tools.demo')} --out build/demo",
    )
    parser.add_argument(
        "job", choices=("scan", "preemption"), nargs="?", default="scan", help="what is shown (default: scan)"
    )
    parser.add_argument("--out", metavar="DIR", type=Path, required=True, help="output folder")
    return parser


def _run(options: argparse.Namespace) -> int:
    options.out.mkdir(parents=True, exist_ok=True)
    if options.job == "preemption":
        from tools.preemption import draw_preemption  # noqa: PLC0415  # it loads matplotlib

        print(draw_preemption(options.out))
        return 0
    return scan_on_a_pty(options.out)


def scan_on_a_pty(out: Path) -> int:
    """Plan, run, verify and show the scan; return the exit status of the plan, or of the last run."""
    command = ["plan", SCAN, "--out", str(out)]
    _say(f"python -m planner {' '.join(command)}")
    if status := planner(command):
        return status
    status = run_on_a_pty(out, FAST)
    if status in _NOT_VERIFIED:
        _say(f"not verified at {FAST:g} times real time: this machine is busy; once more, in real time")
        status = run_on_a_pty(out, 1.0)
    if (page := out / "run" / REPORT_FILE).is_file():
        print(page)
    return status


def run_on_a_pty(out: Path, time_scale: float) -> int:
    """Run the plan in a folder on an emulator of its own, verify it, and return the exit status."""
    from tools.preemption import start_emulator  # noqa: PLC0415  # it loads matplotlib

    scale = ["--time-scale", f"{time_scale:g}"]
    # The path of a socket must be short, but `out` need not be.
    with tempfile.TemporaryDirectory() as folder:
        control = str(Path(folder) / "control")
        with start_emulator("--pty", "--control", control, *scale) as port:
            command = ["run", str(out / "plan.json"), "--port", port, "--control", control, "--arm-away"]
            command += [*scale, "--lead", f"{LEAD_S:g}", "--out", str(out / "run")]
            _say(f"python -m planner {' '.join(command)}")
            return planner(command)


def _say(sentence: str) -> None:
    print(f"demo: {sentence}", file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main())
