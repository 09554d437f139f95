"""Recordings of a table's motion, and their files.

Over the wire (`WireRecording`), a CSV file with the columns

    time_s        when the line was complete at the table, on the recorder's clock
    command       `P 30.0`, `R`, `S` and `A` likewise; `H` in the row of a reading
    position_deg  the answer to `H`, empty in the rows of the other commands
    reply_s       when the reply was complete, on the same clock; the column may be missing or empty

From a drive (`DriveRecording`), or from the emulator's own trace, a CSV file that has among its columns `time_s`,
`duty` (-1..1) and `position_deg` or `encoder_deg`.

The names of the columns and commands may be in upper or lower case, the separator a comma, a semicolon or a tab.
"""

import csv
from itertools import pairwise
from math import floor, isnan, nan
from pathlib import Path
from typing import NamedTuple

import numpy as np

from protocol.files.data_file import shortened
from protocol.files.whole_file import whole_file
from tools.emulated import Array
from tools.identification.csv_table import Row, Table, check_decimals, read_table
from tools.identification.errors import RecordingError

BITS_A_BYTE = 10
"""On the line: a start bit, eight of data, a stop bit."""

COLUMNS = ("time_s", "command", "position_deg")
_REPLY = "reply_s"
_MOST_DECIMALS = 6


class Sent(NamedTuple):
    """A command other than H."""

    time_s: float
    verb: str
    value: float
    reply_s: float = nan  # time of its complete reply, if known


class WireRecording(NamedTuple):
    """Commands, and polled positions, in the order of their times."""

    commands: tuple[Sent, ...]
    time_s: Array
    position_deg: Array
    reply_s: Array  # times of the complete replies; NaN if unknown

    @property
    def resolution_deg(self) -> float:
        """The step of the decimal grid of all positions: 0.1 for replies with one decimal."""
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
            (f"{time_s:.6f}", command, angle, "" if isnan(reply_s) else f"{reply_s:.6f}")
            for time_s, command, angle, reply_s in sorted(rows, key=lambda row: row[0])
        )


def read_recording(path: Path) -> WireRecording | DriveRecording:
    """Return the recording of either kind from a CSV file. An exact copy of a row is ignored.

    Raises:
        RecordingError: the file has neither format, a row cannot be read, or the rows are not in the order of their
            times.
        OSError: the file cannot be opened.
    """
    table = read_table(path)
    if table.has(COLUMNS):
        check_decimals(table, (*COLUMNS, _REPLY))
        return _wire(_in_order(table))
    position = next((name for name in ("position_deg", "encoder_deg") if table.has([name])), None)
    if position and table.has(["time_s", "duty"]):
        names = ("time_s", "duty", position)
        check_decimals(table, names)
        table = _in_order(table)
        columns = ([table.number(row, name, row.cells[name]) for row in table.rows] for name in names)
        return DriveRecording(*map(np.array, columns))
    columns_there = shortened(", ".join(table.names)) or "(none)"
    raise RecordingError(
        f"{path}: has the columns {columns_there}; required are {', '.join(COLUMNS)} "
        "(over the wire), or time_s, duty and position_deg or encoder_deg (from a drive)"
    )


def _in_order(table: Table) -> Table:
    """Return the table without repeated rows; refuse rows that are not in the order of their times."""
    distinct: dict[tuple[str, ...], Row] = {}
    for row in table.rows:
        distinct.setdefault(tuple(row.cells.values()), row)
    rows = tuple(distinct.values())
    times = [table.number(row, "time_s", row.cells["time_s"]) for row in rows]
    back = [index for index, (before, after) in enumerate(pairwise(times), start=1) if after < before]
    if back:
        first = back[0]
        raise table.error(
            rows[first],
            f"time_s goes back from {times[first - 1]:g} to {times[first]:g} s, the first of {len(back)} such places; "
            "the rows must be in the order of their times, and the clock must not be set meanwhile",
        )
    return table._replace(rows=rows)


def _wire(table: Table) -> WireRecording:
    """Return the rows as a recording whose times start within the first second: a clock may have any origin."""
    begin_s = floor(table.number(table.rows[0], "time_s", table.rows[0].cells["time_s"])) if table.rows else 0
    commands, times, positions, replies = [], [], [], []
    for row in table.rows:
        command = row.cells["command"]
        verb, value = command[:1].upper(), command[1:].strip()
        if verb not in set("HPRSA") or (verb == "H" and value):
            raise table.error(row, f"the command is {command!r}; it must be H, P, R, S or A")
        time_s = table.number(row, "time_s", row.cells["time_s"]) - begin_s
        reply_s = table.number(row, _REPLY, row.cells[_REPLY]) - begin_s if row.cells.get(_REPLY) else nan
        if verb == "H":
            times.append(time_s)
            replies.append(reply_s)
            positions.append(table.number(row, "position_deg", row.cells["position_deg"]))
        else:
            commands.append(Sent(time_s, verb, table.number(row, "command", value), reply_s))
    return WireRecording(tuple(commands), np.array(times), np.array(positions), np.array(replies))
