"""CSV files as written by programs and spreadsheets: byte order mark, separator, case of the names, decimal comma."""

import csv
import logging
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tools.identification.errors import RecordingError

_log = logging.getLogger(__name__)

_SEPARATORS = ",;\t"
_UTF_16 = (b"\xff\xfe", b"\xfe\xff")


class Row(NamedTuple):
    """The cells of a line, by the lowercase names of their columns."""

    line: int
    cells: dict[str, str]


class Table(NamedTuple):
    """A CSV file: names as written, and rows; an empty line is not a row."""

    path: Path
    names: tuple[str, ...]
    rows: tuple[Row, ...]

    def has(self, names: Iterable[str]) -> bool:
        """Return whether there are columns with all these names, in upper or lower case."""
        return {name.casefold() for name in names} <= {name.casefold() for name in self.names}

    def error(self, row: Row, problem: str) -> RecordingError:
        """Return the error for a row."""
        return RecordingError(f"{self.path}: line {row.line}: {problem}")

    def number(self, row: Row, name: str, text: str) -> float:
        """Return a number with a decimal point or a decimal comma."""
        try:
            value = float(text.replace(",", ".") if text.count(",") == 1 and "." not in text else text)
        except ValueError:
            value = np.nan
        if not np.isfinite(value):
            raise self.error(row, f"{name} is {text!r}; it must be a number without thousands separators")
        return value


def read_table(path: Path) -> Table:
    """Return a CSV file.

    Raises:
        RecordingError: the file is not text, or a line has more cells than the header.
        OSError: the file cannot be opened.
    """
    text = _text(path)
    lines = text.splitlines(keepends=True)
    skipped = 1 if lines and lines[0].casefold().startswith("sep=") else 0  # the separator line of a spreadsheet
    header = next((line for line in lines[skipped:] if line.strip()), "")
    separator = max(_SEPARATORS, key=header.count)
    reader = csv.reader(lines[skipped:], delimiter=separator)
    try:
        rows = [(reader.line_num + skipped, [cell.strip() for cell in row]) for row in reader if any(row)]
    except csv.Error as error:
        raise RecordingError(f"{path}: line {reader.line_num + skipped}: is not CSV: {error}") from error
    names = rows[0][1] if rows else []
    keys = [name.casefold() for name in names]
    twice = next((name for name in names if name and keys.count(name.casefold()) > 1), None)
    if twice:
        raise RecordingError(f"{path}: has two columns {twice}; the names of the columns must differ")
    return Table(path, tuple(names), tuple(_row(path, line, keys, cells, separator) for line, cells in rows[1:]))


def check_decimals(table: Table, names: Iterable[str]) -> None:
    """Refuse a file that mixes decimal points and decimal commas."""
    keys = [name.casefold() for name in names]
    first: dict[str, int] = {}
    for row in table.rows:
        for key in keys:
            for mark in ".,":
                if mark in row.cells.get(key, ""):
                    first.setdefault(mark, row.line)
    if len(first) > 1:
        raise RecordingError(
            f"{table.path}: line {first['.']} has a decimal point, line {first[',']} a decimal comma; use one of them"
        )


def _text(path: Path) -> str:
    data = path.read_bytes()
    _log.debug("read %s, %d bytes", path, len(data))
    if data.startswith(_UTF_16):
        raise RecordingError(f"{path}: is UTF-16 text; save it as CSV in UTF-8")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise RecordingError(
            f"{path}: is not a CSV file: line {line} holds byte 0x{data[error.start]:02X}, which is not UTF-8"
        ) from error


def _row(path: Path, line: int, keys: list[str], cells: list[str], separator: str) -> Row:
    if len(keys) > 1 and any(cells[len(keys) :]):  # a single name is not a header; the check of the columns finds this
        comma = "; with a decimal comma, separate the columns by semicolons" if separator == "," else ""
        raise RecordingError(f"{path}: line {line} has {len(cells)} cells, but there are {len(keys)} columns{comma}")
    return Row(line, dict.fromkeys(keys, "") | dict(zip(keys, cells, strict=False)))
