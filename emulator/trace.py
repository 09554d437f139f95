"""Record what the table does, tick by tick, in a CSV or npz file.

A row is one tick. A stretch in which nothing changes is written as its first and its last tick, so that a table at
rest costs nothing and a line drawn through the rows is still the true one.
"""

import csv
from array import array
from operator import attrgetter
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, Self

from emulator.status import TableStatus

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


class Trace(NamedTuple):
    """A recorded run, one entry a row in every column. `received` and `transmitted` are the firmware's side."""

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
_BYTES = ("received", "transmitted")
_WORDS = ("gain_set", "state")
_NUMBERS = tuple(name for name in _COLUMNS if name not in {*_WORDS, *_BYTES})
_values_of = attrgetter(*_NUMBERS[1:], *_WORDS)

_Values = tuple[float | str, ...]


class TraceWriter:
    """A recorder for `Table.observer`. The file appears under its name when the trace is closed, and not before.

    Args:
        path: ends in `.csv` or `.npz`. A CSV is written as it comes; an npz is kept in memory until the end.
        tick_hz: ticks in a simulated second.

    Raises:
        ValueError: the path ends in something else.
        OSError: the file cannot be written.
    """

    def __init__(self, path: Path, tick_hz: int) -> None:
        if path.suffix not in {".csv", ".npz"}:
            raise ValueError(f"{path}: the name of a trace must end in .csv or .npz")
        self._path = path
        self._tick_hz = tick_hz
        self._partial = path.with_name(path.name + ".part")
        self._sink: _Sink = _CsvSink(self._partial) if path.suffix == ".csv" else _NpzSink(self._partial)
        self._last_tick = -1
        self._written_tick = -1
        self._last: _Values = ()

    def record(self, status: TableStatus, received: bytes, transmitted: bytes) -> None:
        """Take in one tick."""
        values: _Values = _values_of(status)
        if values != self._last or received or transmitted:
            self._write_held(status.tick - 1)
            self._write(status.tick, values, received, transmitted)
        self._last, self._last_tick = values, status.tick

    def close(self) -> None:
        """Complete the file and give it its name."""
        self._write_held(self._last_tick)
        self._sink.close()
        self._partial.replace(self._path)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()

    def _write_held(self, tick: int) -> None:
        """Write the last tick of a stretch without change, when it is not there yet."""
        if self._last and tick > self._written_tick:
            self._write(tick, self._last, b"", b"")

    def _write(self, tick: int, values: _Values, received: bytes, transmitted: bytes) -> None:
        self._sink.add((tick / self._tick_hz, *values), received, transmitted)
        self._written_tick = tick


def read_trace(path: Path) -> Trace:
    """Return a trace that `TraceWriter` wrote.

    Raises:
        ValueError: the file is no trace.
        OSError: the file cannot be read.
    """
    import numpy as np  # noqa: PLC0415  # the stand-in itself runs without numpy

    columns = _read_npz(path) if path.suffix == ".npz" else _read_csv(path)

    def numbers(name: str) -> "NDArray[np.float64]":
        return np.array(columns[name], dtype=np.float64)

    def words(name: str) -> list[str]:
        return [str(word) for word in columns[name]]

    def octets(name: str) -> list[bytes]:
        return [_as_bytes(word) for word in words(name)]

    columns_as: list[Any] = [*map(numbers, _NUMBERS), *map(words, _WORDS), *map(octets, _BYTES)]
    return Trace(*columns_as)


class _Sink(Protocol):
    def add(self, values: _Values, received: bytes, transmitted: bytes) -> None: ...

    def close(self) -> None: ...


class _CsvSink:
    """Rows straight to the file, under a header of column names that end in their unit."""

    def __init__(self, path: Path) -> None:
        self._file = path.open("w", encoding="ascii", newline="")
        self._writer = csv.writer(self._file, lineterminator="\n")
        self._writer.writerow(_COLUMNS)

    def add(self, values: _Values, received: bytes, transmitted: bytes) -> None:
        self._writer.writerow((*values, _as_text(received), _as_text(transmitted)))

    def close(self) -> None:
        self._file.close()


class _NpzSink:
    """Columns in memory, packed at the end."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._numbers = [array("d") for _ in _NUMBERS]
        self._texts: list[list[str]] = [[] for _ in (*_WORDS, *_BYTES)]
        path.touch()

    def add(self, values: _Values, received: bytes, transmitted: bytes) -> None:
        for column, number in zip(self._numbers, values, strict=False):
            column.append(float(number))
        words = map(str, values[len(_NUMBERS) :])
        for texts, text in zip(self._texts, (*words, _as_text(received), _as_text(transmitted)), strict=True):
            texts.append(text)

    def close(self) -> None:
        import numpy as np  # noqa: PLC0415  # only who asks for npz needs numpy

        arrays = [np.array(column) for column in (*self._numbers, *self._texts)]
        columns: dict[str, Any] = dict(zip(_COLUMNS, arrays, strict=True))
        with self._path.open("wb") as file:
            np.savez_compressed(file, **columns)


def _read_csv(path: Path) -> dict[str, list[str]]:
    with path.open(encoding="ascii", newline="") as file:
        rows = csv.reader(file)
        if tuple(next(rows, ())) != _COLUMNS:
            raise ValueError(f"{path}: is no trace; its first line must be {','.join(_COLUMNS)}")
        columns = [list(column) for column in zip(*rows, strict=True)] or [[] for _ in _COLUMNS]
    return dict(zip(_COLUMNS, columns, strict=True))


def _read_npz(path: Path) -> "dict[str, NDArray[np.float64 | np.str_]]":
    import numpy as np  # noqa: PLC0415  # the stand-in itself runs without numpy

    with np.load(path, allow_pickle=False) as file:
        if set(file.files) != set(_COLUMNS):
            raise ValueError(f"{path}: is no trace; its arrays must be {', '.join(_COLUMNS)}")
        return {name: file[name] for name in _COLUMNS}


def _as_text(data: bytes) -> str:
    r"""Return bytes as printable ASCII: a carriage return reads `\r`."""
    return data.decode("latin-1").encode("unicode_escape").decode("ascii")


def _as_bytes(text: str) -> bytes:
    return text.encode("ascii").decode("unicode_escape").encode("latin-1")
