"""Identify a table: record the right motion over a port, and estimate the constants from a recording.

python -m tools.identify record --port emulator:// --out trace.csv
python -m tools.identify fit trace.csv --out table.toml
"""

import protocol.quiet_start  # noqa: F401 - before the imports that take long

# isort: split
import argparse
import sys
from math import inf
from pathlib import Path

from emulator.config.table_config import ConfigError, load_config
from protocol.client import TableClient
from protocol.command_line import Parser, program_name
from protocol.ending import ended
from protocol.errors import TableError
from protocol.page import Origin
from protocol.progress import share_shown
from protocol.whole_file import write_whole
from tools.command_line import check_writable
from tools.identification.errors import RecordingError
from tools.identification.excitation import excitation
from tools.identification.fit_checks import check_fit, motor_at_odds
from tools.identification.fit_report import fit_report, table_toml, verdict
from tools.identification.identify_table import identify
from tools.identification.recorder import record
from tools.identification.recording import read_recording, write_recording
from tools.identification.recording_checks import LEAST_DURATION_S, LONGEST_DURATION_S, check_line, check_recording

_NEEDED = ("gain", "time constant", "Coulomb friction")


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; return its exit status."""
    options = parser().read(arguments)
    return ended("identify", lambda: int(options.run(options)), ConfigError, RecordingError, TableError)


def _record(options: argparse.Namespace) -> int:
    for name, least, most in (
        ("duration", LEAST_DURATION_S, LONGEST_DURATION_S),
        ("speed", 1.0, inf),
        ("acceleration", 1.0, inf),
        ("baud", 0, inf),
        ("seed", 0, inf),
    ):
        value = getattr(options, name)
        if not least <= value <= most or value == inf:
            allowed = f"at least {least:g}" if most == inf else f"within {least:g} to {most:g}"
            raise RecordingError(f"--{name} is {value:g}; it must be {allowed}")
    check_writable(options.out)
    config = load_config(options.config).with_serial(baud=options.baud)
    bursts = excitation(options.duration, options.speed, options.acceleration, options.seed)
    with TableClient.open(options.port, baud=options.baud) as client, share_shown("recording") as progress:
        recording = record(
            client, bursts, options.speed, options.baud, progress, lambda so_far: check_line(config, so_far)
        )
    write_recording(options.out, recording)
    print(f"{options.out}: {len(recording.time_s)} readings, {len(recording.commands)} commands")
    return 0


def _fit(options: argparse.Namespace) -> int:
    report = options.out.with_suffix(".html")
    for path in (options.out, report):
        check_writable(path)
    _check_distinct([options.recording, *([options.config] if options.config else []), options.out, report])
    config = load_config(options.config)
    recording = read_recording(options.recording)
    try:
        check_recording(config, recording)
    except RecordingError as error:
        raise RecordingError(f"{options.recording}: {error}") from error
    with share_shown("fitting") as progress:
        found = identify(config, recording, progress)
    try:
        check_fit(found)
    except RecordingError as error:
        raise RecordingError(f"{options.recording}: {error}") from error
    print("\n".join(map(verdict, found.constants)))
    missing = [constant.name for constant in found.constants if constant.name in _NEEDED and not constant.identifiable]
    if missing:
        raise RecordingError(
            f"{options.recording}: {', '.join(missing)} not identifiable: too short, or too little excitation"
        )
    odds = motor_at_odds(found, config)
    if odds:
        print(f"identify: warning: {odds}", file=sys.stderr)
    page = fit_report(found, config, str(options.recording), odds, Origin(options.command_line))
    write_whole(options.out, table_toml(found, odds))
    write_whole(report, page)
    print(f"wrote {options.out} and {report}", file=sys.stderr)
    return 0


def _check_distinct(paths: list[Path]) -> None:
    """Refuse to write over what is read, or the report over the constants."""
    for path in paths:
        if [other.resolve() for other in paths].count(path.resolve()) > 1:
            raise RecordingError(
                f"{path} would be written over; --out must be another file, and its name not end in .html"
            )


def parser() -> Parser:
    """Return the parser of the command line."""
    parser = Parser(
        prog=program_name("tools.identify"), description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    commands = parser.add_subparsers(required=True)
    summary = "move a table and record its replies (by default within a quarter of a turn)"
    recorder = commands.add_parser("record", help=summary, description=summary)
    recorder.add_argument("--port", required=True, metavar="URL", help="/dev/ttyUSB0, socket://host:7000, emulator://")
    recorder.add_argument("--out", required=True, type=Path, metavar="FILE", help="CSV file to write")
    recorder.add_argument("--baud", type=int, default=9600, help="baud rate (default: 9600)")
    recorder.add_argument(
        "--duration", type=float, default=60.0, metavar="S", help="length of the recording (default: 60)"
    )
    recorder.add_argument("--speed", type=float, default=40.0, metavar="DEG_S", help="maximum speed (default: 40)")
    recorder.add_argument(
        "--acceleration", type=float, default=100.0, metavar="DEG_S2", help="maximum acceleration (default: 100)"
    )
    recorder.add_argument("--config", type=Path, help="known constants of the table: the tick rate of its controller")
    recorder.add_argument("--seed", type=int, default=0, help="random seed of the swings (default: 0)")
    recorder.set_defaults(run=_record)
    summary = "estimate the constants of the recorded table"
    fitter = commands.add_parser("fit", help=summary, description=summary)
    fitter.add_argument("recording", type=Path, help="a CSV of `record`, of the emulator's trace, or of a drive")
    fitter.add_argument(
        "--out", required=True, type=Path, metavar="FILE", help="TOML file to write; the report is written beside it"
    )
    fitter.add_argument(
        "--config", type=Path, help="known constants: gains, encoder, datasheet (default: the default table)"
    )
    fitter.set_defaults(run=_fit)
    return parser


if __name__ == "__main__":
    sys.exit(main())
