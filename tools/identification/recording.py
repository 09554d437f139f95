"""Recordings of a table's motion, and their files.

Over the wire (`WireRecording`), a CSV file with the columns

    time_s        when the line was complete at the table, on the recorder's clock
    command       `P 30.0`, `R`, `S` and `A` likewise; `H` in the row of a reading
    position_deg  the answer to `H`, empty in the rows of the other commands
    reply_s       when the reply was complete, on the same clock; may be missing

From a drive (`DriveRecording`), or from the emulator's own trace, a CSV file that has among its columns `time_s`,
`duty` (-1..1) and `position_deg` or `encoder_deg`.
"""

import csv
from math import nan
from pathlib import Path
from typing import NamedTuple

import numpy as np

from planner.whole_file import whole_file
from tools.emulated import Array

BITS_A_BYTE = 10
"""On the line: a start bit, eight of data, a stop bit."""

COLUMNS = ("time_s", "command", "position_deg")
_REPLY = "reply_s"
_MOST_DECIMALS = 6


class RecordingError(ValueError):
    """A recording that cannot be used; the message names the place and what is wrong with it."""


class Sent(NamedTuple):
    """A command other than H."""

    time_s: float
    verb: str
    value: float
    reply_s: float = nan  # when its reply was complete, if it is known


class WireRecording(NamedTuple):
    """Commands, and positions that were polled, in the order of their times."""

    commands: tuple[Sent, ...]
    time_s: Array
    position_deg: Array
    reply_s: Array  # when the replies were complete; NaN where it is not known

    @property
    def resolution_deg(self) -> float:
        """The step of the decimal grid on which all positions lie: 0.1 for replies with one decimal."""
        decimals = 1
        while decimals < _MOST_DECIMALS and np.abs(self.position_deg - self.position_deg.round(decimals)).max() > 1e-9:
            decimals += 1
        return 10.0**-decimals


class DriveRecording(NamedTuple):
    """Duty and position of a drive, at its own rate."""

    time_s: Array
    duty: Array
    position_deg: Array


def write_recording(path: Path, recording: WireRecording) -> None:
    """Write a recording; the file appears under its name when it is complete."""
    rows = [(sent.time_s, f"{sent.verb} {sent.value}", "", sent.reply_s) for sent in recording.commands]
    readings = zip(recording.time_s, recording.position_deg, recording.reply_s, strict=True)
    rows += [(float(time_s), "H", str(angle_deg), float(reply_s)) for time_s, angle_deg, reply_s in readings]
    with whole_file(path) as partial, partial.open("w", encoding="ascii", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow((*COLUMNS, _REPLY))
        writer.writerows(
            (f"{time_s:.6f}", command, angle, f"{reply_s:.6f}")
            for time_s, command, angle, reply_s in sorted(rows, key=lambda row: row[0])
        )


def read_recording(path: Path) -> WireRecording | DriveRecording:
    """Return the recording in a CSV file, of whichever kind it is.

    Raises:
        RecordingError: The file is neither, or a row cannot be read.
        OSError: The file cannot be opened.
    """
    try:
        with path.open(encoding="ascii", newline="") as file:
            reader = csv.DictReader(file)
            names, rows = reader.fieldnames or [], list(reader)
    except (UnicodeDecodeError, csv.Error) as error:
        raise RecordingError(f"{path}: is not a CSV file: {error}") from error
    if set(COLUMNS) <= set(names):
        return _wire(path, rows)
    position = next((name for name in ("position_deg", "encoder_deg") if name in names), None)
    if position and {"time_s", "duty"} <= set(names):
        columns = [_numbers(path, rows, name) for name in ("time_s", "duty", position)]
        return DriveRecording(*columns)
    raise RecordingError(
        f"{path}: has the columns {', '.join(names) or '(none)'}; needed are {', '.join(COLUMNS)} (over the wire), "
        "or time_s, duty and position_deg or encoder_deg (from a drive)"
    )


def _wire(path: Path, rows: list[dict[str, str]]) -> WireRecording:
    commands, times, positions, replies = [], [], [], []
    for line, row in enumerate(rows, start=2):
        verb, _, value = (row["command"] or "").partition(" ")
        if verb not in set("HPRSA"):
            raise RecordingError(f"{path}: line {line}: the command is {row['command']!r}; it must be H, P, R, S or A")
        time_s = _number(path, line, "time_s", row["time_s"])
        reply_s = _number(path, line, _REPLY, row[_REPLY]) if _REPLY in row else nan
        if verb == "H":
            times.append(time_s)
            replies.append(reply_s)
            positions.append(_number(path, line, "position_deg", row["position_deg"]))
        else:
            commands.append(Sent(time_s, verb, _number(path, line, "command", value), reply_s))
    return WireRecording(tuple(commands), np.array(times), np.array(positions), np.array(replies))


def _numbers(path: Path, rows: list[dict[str, str]], name: str) -> Array:
    return np.array([_number(path, line, name, row[name]) for line, row in enumerate(rows, start=2)])


def _number(path: Path, line: int, name: str, text: str | None) -> float:
    try:
        value = float(text or "")
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise RecordingError(f"{path}: line {line}: {name} is {text!r}; it must be a number")
    return value
