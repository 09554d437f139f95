"""Record the state of the table, tick by tick, in a CSV or npz file.

A row is one tick. If nothing changes for some time, only the first and the last tick are written. So a table at rest
needs no space, and a line through the rows is still correct.
"""

import csv
import os
import zipfile
import zlib
from collections.abc import Mapping
from contextlib import suppress
from operator import attrgetter
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, NamedTuple, Self

from protocol.bench import TableStatus

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


class Trace(NamedTuple):
    """A recorded run, with one entry per row in every column.

    `received` and `transmitted` are from the firmware's side.
    """

    time_s: "NDArray[np.float64]"
    reference_deg: "NDArray[np.float64]"
    encoder_deg: "NDArray[np.float64]"
    true_deg: "NDArray[np.float64]"
    reference_speed_deg_s: "NDArray[np.float64]"
    speed_deg_s: "NDArray[np.float64]"
    true_speed_deg_s: "NDArray[np.float64]"
    current_A: "NDArray[np.float64]"
    duty: "NDArray[np.float64]"
    gain_set: list[str]
    state: list[str]
    received: list[bytes]
    transmitted: list[bytes]


_COLUMNS = Trace._fields
_LONGEST_REASON = 200
_BYTES = ("received", "transmitted")
_WORDS = ("gain_set", "state")
_NUMBERS = tuple(name for name in _COLUMNS if name not in {*_WORDS, *_BYTES})
_values_of = attrgetter(*_NUMBERS[1:], *_WORDS)

_Values = tuple[float | str, ...]


class TraceError(Exception):
    """A trace that cannot be started or completed. The message names the partial file, and the next step."""


class TraceWriter:
    """A recorder for `Table.observer`. The file appears under its name only when the trace is complete.

    Until then a CSV file with the suffix `.part` grows, for npz too. After a failure it remains.

    Args:
        path: ends in `.csv` or `.npz`.
        tick_hz: ticks per simulated second.

    Raises:
        TraceError: the file cannot be written at the end, as far as this is known now.
    """

    def __init__(self, path: Path, tick_hz: int) -> None:
        _check_name(path)
        self._path = path
        self._tick_hz = tick_hz
        self._partial = path.with_name(path.name + ".part")
        try:
            # Exclusive: another emulator's trace is not changed, and no symbolic link is followed.
            self._file = self._partial.open("x", encoding="ascii", newline="")
        except FileExistsError:
            raise TraceError(
                f"{self._partial} exists: another emulator is writing it, or a failed one left it; "
                "choose another name, or remove the file"
            ) from None
        except OSError as error:
            raise TraceError(f"{path}: {error.strerror}; choose another name") from error
        self._writer = csv.writer(self._file, lineterminator="\n")
        self._last_tick = -1
        self._written_tick = -1
        self._last: _Values = ()
        self._write_row(_COLUMNS)

    def record(self, status: TableStatus, received: bytes, transmitted: bytes) -> None:
        """Record one tick.

        Raises:
            TraceError: the rows written so far remain in the file that ends in `.part`.
        """
        values: _Values = _values_of(status)
        if values != self._last or received or transmitted:
            self._write_held(status.tick - 1)
            self._write(status.tick, values, received, transmitted)
        self._last, self._last_tick = values, status.tick

    def close(self) -> None:
        """Complete the file and rename it.

        Raises:
            TraceError: the rows written so far remain in the file that ends in `.part`.
        """
        self._write_held(self._last_tick)
        try:
            self._file.flush()
            os.fsync(self._file.fileno())  # some file systems report only here that they are full
            self._file.close()
            if self._path.suffix == ".csv":
                self._partial.replace(self._path)
            else:
                _pack(self._partial, self._path)
        except (OSError, MemoryError) as error:
            raise self._failed(error) from error

    def abandon(self) -> None:
        """Leave the rows written so far in the file that ends in `.part`."""
        with suppress(OSError):
            self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        if kind is None:
            self.close()
        else:
            self.abandon()

    def _write_held(self, tick: int) -> None:
        """Write the last tick of a run without change, unless it is already written."""
        if self._last and tick > self._written_tick:
            self._write(tick, self._last, b"", b"")

    def _write(self, tick: int, values: _Values, received: bytes, transmitted: bytes) -> None:
        self._write_row((tick / self._tick_hz, *values, _as_text(received), _as_text(transmitted)))
        self._written_tick = tick

    def _write_row(self, row: tuple[float | str, ...]) -> None:
        try:
            self._writer.writerow(row)
        except OSError as error:
            raise self._failed(error) from error

    def _failed(self, error: OSError | MemoryError) -> TraceError:
        """Close the file, and return the error that names the remaining file."""
        self.abandon()
        reason = (isinstance(error, OSError) and error.strerror) or "out of memory"
        return TraceError(f"{self._path}: {reason}; the rows written so far are in {self._partial}, as CSV")


def read_trace(path: Path) -> Trace:
    """Return a trace that `TraceWriter` wrote.

    Raises:
        ValueError: the file is not a trace.
        OSError: the file cannot be read.
    """
    try:
        return _trace_of(_read_npz(path) if path.suffix == ".npz" else _read_csv(path))
    except UnicodeError as error:
        raise ValueError(f"{path}: is not a trace: it is not text in ASCII") from error
    except (ValueError, TypeError, EOFError, NotImplementedError, csv.Error, zipfile.BadZipFile, zlib.error) as error:
        raise ValueError(f"{path}: is not a trace: {' '.join(str(error)[:_LONGEST_REASON].split())}") from error


def _trace_of(columns: Mapping[str, Any]) -> Trace:
    import numpy as np  # noqa: PLC0415  # the emulator itself runs without numpy

    def numbers(name: str) -> "NDArray[np.float64]":
        return np.array(columns[name], dtype=np.float64)

    def words(name: str) -> list[str]:
        return [str(word) for word in columns[name]]

    def octets(name: str) -> list[bytes]:
        return [_as_bytes(word) for word in words(name)]

    columns_as: list[Any] = [*map(numbers, _NUMBERS), *map(words, _WORDS), *map(octets, _BYTES)]
    return Trace(*columns_as)


def _check_name(path: Path) -> None:
    """Check at the start of a run that the trace can be written at its end."""
    if path.suffix not in {".csv", ".npz"}:
        raise TraceError(f"{path}: the name of a trace must end in .csv or .npz")
    if path.is_dir():
        raise TraceError(f"{path}: is a folder; choose another name")
    if path.suffix == ".npz":
        try:
            import numpy  # noqa: F401, PLC0415, ICN001  # check whether it can be imported; only npz needs it
        except ImportError:
            raise TraceError(
                f"{path}: .npz needs numpy; choose a .csv file, or run: pip install 'seventh-axis[planner]'"
            ) from None


def _pack(source: Path, path: Path) -> None:
    """Write a trace as npz, and remove its CSV file."""
    import numpy as np  # noqa: PLC0415  # needed only for npz

    trace = read_trace(source)._asdict()
    texts = {name: [_as_text(data) for data in trace[name]] for name in _BYTES}
    columns: dict[str, Any] = {name: np.array(column) for name, column in (trace | texts).items()}
    packed = path.with_name(f"{path.name}.{os.getpid()}.part")
    with packed.open("xb") as file:
        try:
            np.savez_compressed(file, **columns)
            file.flush()
            os.fsync(file.fileno())
        except BaseException:
            packed.unlink()
            raise
    packed.replace(path)
    source.unlink()


def _read_csv(path: Path) -> dict[str, list[str]]:
    with path.open(encoding="ascii", newline="") as file:
        rows = csv.reader(file)
        if tuple(next(rows, ())) != _COLUMNS:
            raise ValueError(f"its first line must be {','.join(_COLUMNS)}")
        columns = [list(column) for column in zip(*rows, strict=True)] or [[] for _ in _COLUMNS]
    return dict(zip(_COLUMNS, columns, strict=True))


def _read_npz(path: Path) -> "dict[str, NDArray[np.float64 | np.str_]]":
    import numpy as np  # noqa: PLC0415  # the emulator itself runs without numpy

    with path.open("rb") as data, np.load(data, allow_pickle=False) as file:
        if set(file.files) != set(_COLUMNS):
            raise ValueError(f"its arrays must be {', '.join(_COLUMNS)}")
        return {name: file[name] for name in _COLUMNS}


def _as_text(data: bytes) -> str:
    r"""Return bytes as printable ASCII: a carriage return is written as `\r`."""
    return data.decode("latin-1").encode("unicode_escape").decode("ascii")


def _as_bytes(text: str) -> bytes:
    return text.encode("ascii").decode("unicode_escape").encode("latin-1")
