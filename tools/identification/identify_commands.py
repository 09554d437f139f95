"""Run the commands of `python -m tools.identify`: a function for each."""

import argparse
import sys
from math import inf
from pathlib import Path

from emulator.config.table_config import load_config
from protocol.client import TableClient
from protocol.files.whole_file import write_whole
from protocol.program.page import Origin
from protocol.program.progress import share_shown
from tools.command_line import check_writable
from tools.identification.errors import RecordingError
from tools.identification.excitation import excitation
from tools.identification.fit_checks import check_fit, motor_at_odds
from tools.identification.fit_report import fit_report, table_toml, verdict
from tools.identification.identify_table import identify
from tools.identification.recorder import record as record_bursts
from tools.identification.recording import read_recording, write_recording
from tools.identification.recording_checks import LEAST_DURATION_S, LONGEST_DURATION_S, check_line, check_recording

_NEEDED = ("gain", "time constant", "Coulomb friction")


def record(options: argparse.Namespace) -> int:
    """Move a table, write its replies, and return the exit status."""
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
        recording = record_bursts(
            client, bursts, options.speed, options.baud, progress, lambda so_far: check_line(config, so_far)
        )
    write_recording(options.out, recording)
    print(f"{options.out}: {len(recording.time_s)} readings, {len(recording.commands)} commands")
    return 0


def fit(options: argparse.Namespace) -> int:
    """Estimate a table's constants, write them and a report, and return the exit status."""
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
    """Refuse to overwrite an input, or the constants with the report."""
    for path in paths:
        if [other.resolve() for other in paths].count(path.resolve()) > 1:
            raise RecordingError(f"{path} would be overwritten; --out must be another file that does not end in .html")
