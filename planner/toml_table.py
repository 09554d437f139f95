"""Read a TOML file key by key, and refuse unknown keys.

Every error names the file, the key, its value and the allowed values: a typing error in a configuration must never
result in a silent default.
"""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Self

from planner.errors import ScanFileError
from protocol.data_file import DataFileError, did_you_mean, read_toml, shown


class TomlTable:
    """One table of a TOML file, which records the keys that were read."""

    def __init__(self, file: Path, values: dict[str, Any], prefix: str = "") -> None:
        self.file = file
        self._values = values
        self._prefix = prefix
        self._read: set[str] = set()

    @classmethod
    def load(cls, file: Path) -> Self:
        """Return the top table of `file`.

        Raises:
            ScanFileError: the file cannot be read or is not TOML.
        """
        try:
            return cls(file, read_toml(file))
        except DataFileError as error:
            raise ScanFileError(str(error)) from error

    def __contains__(self, key: str) -> bool:
        return key in self._values

    def name_of(self, key: str) -> str:
        """Return the full name of `key` with its tables, such as `cell.probe.stand_off_mm`."""
        return f"{self._prefix}{key}"

    def refuse(self, key: str, allowed: str) -> ScanFileError:
        """Return the error with the value of `key` and the allowed values."""
        name = f"{self.file}: {self.name_of(key)}"
        if key not in self._values:
            misspelt = self._misspelt(key)
            first = "" if misspelt is None else f"{self._prefix}{misspelt} is not a known key; did you mean {key}? "
            return ScanFileError(f"{self.file}: {first}{self._prefix}{key} is missing; it must be {allowed}")
        return ScanFileError(f"{name} is {shown(self._values[key])}; it must be {allowed}")

    def _misspelt(self, key: str) -> str | None:
        """Return an unread key that is similar to a missing one."""
        unread = [other for other in self._values if other not in self._read]
        return next((other for other in unread if did_you_mean(other, [key])), None)

    def _unknown(self, key: str, *known: str) -> ScanFileError:
        return ScanFileError(
            f"{self.file}: {self._prefix}{key} is not a key; allowed are {', '.join(sorted(known))}"
            f"{did_you_mean(key, known)}"
        )

    def _take(self, key: str, default: object = None) -> Any:  # noqa: ANN401 - any type until it is checked
        self._read.add(key)
        return self._values.get(key, default)

    def number(
        self,
        key: str,
        default: float | None = None,
        *,
        above: float = -math.inf,
        at_least: float = -math.inf,
        at_most: float = math.inf,
    ) -> float:
        """Return the finite number `key` in (above, at_most] and [at_least, at_most]; required without a default."""
        value = self._take(key, default)
        if not _is_number(value) or not (value > above and at_least <= value <= at_most):
            raise self.refuse(key, _range_text(above, at_least, at_most))
        return float(value)

    def count(self, key: str, default: int, *, at_least: int, at_most: int) -> int:
        """Return the whole number `key` in [at_least, at_most]."""
        value = self._take(key, default)
        if isinstance(value, bool) or not isinstance(value, int) or not at_least <= value <= at_most:
            raise self.refuse(key, f"a whole number from {at_least} to {at_most}")
        return value

    def numbers(self, key: str, count: int, default: Sequence[float] | None = None) -> tuple[float, ...]:
        """Return the list `key` of `count` finite numbers; required if there is no default."""
        value = self._take(key, default)
        is_list = isinstance(value, list | tuple) and len(value) == count
        if not is_list or not all(map(_is_number, value)):
            raise self.refuse(key, f"a list of {count} finite numbers")
        return tuple(map(float, value))

    def text(self, key: str, default: str | None = None) -> str:
        """Return the text `key`; required if there is no default."""
        value = self._take(key, default)
        if not isinstance(value, str) or not value:
            raise self.refuse(key, "a text")
        return value

    def texts(self, key: str) -> tuple[str, ...]:
        """Return the list `key` of texts; a missing one is empty."""
        value = self._take(key, [])
        if not isinstance(value, list) or not all(isinstance(item, str) and item for item in value):
            raise self.refuse(key, "a list of texts")
        return tuple(value)

    def choice(self, key: str, choices: Sequence[str], default: str | None = None) -> str:
        """Return the text `key`, which is one of `choices`; required if there is no default."""
        value = self._take(key, default)
        if value not in choices:
            raise self.refuse(key, "one of " + ", ".join(choices))
        return str(value)

    def table(self, key: str) -> "TomlTable":
        """Return the table `key`; a missing one is empty, unless a similar name exists."""
        if key not in self._values and (misspelt := self._misspelt(key)) is not None:
            raise self._unknown(misspelt, key)
        value = self._take(key, {})
        if not isinstance(value, dict):
            raise self.refuse(key, "a table")
        return TomlTable(self.file, value, f"{self._prefix}{key}.")

    def tables(self, key: str, count: int) -> list["TomlTable"]:
        """Return the `count` tables of the list `key`."""
        value = self._take(key)
        if not isinstance(value, list) or len(value) != count or not all(isinstance(item, dict) for item in value):
            raise self.refuse(key, f"a list of {count} tables")
        return [TomlTable(self.file, item, f"{self._prefix}{key}[{i + 1}].") for i, item in enumerate(value)]

    def one_or_more(self, key: str) -> list["TomlTable"]:
        """Return the table `key`, or the tables of the list `key`; a missing one is an empty table."""
        value = self._take(key, {})
        if isinstance(value, list) and value and all(isinstance(item, dict) for item in value):
            return [TomlTable(self.file, item, f"{self._prefix}{key}[{i + 1}].") for i, item in enumerate(value)]
        return [self.table(key)]

    def only(self, *known: str) -> None:
        """Refuse keys other than these, before a key is missing because of them.

        Raises:
            ScanFileError: the first such key, with the known keys.
        """
        for key in self._values:
            if key not in known:
                raise self._unknown(key, *known)

    def finish(self) -> None:
        """Refuse keys that were not read.

        Raises:
            ScanFileError: one such key, with the known keys.
        """
        self.only(*self._read)


def _is_number(value: object) -> bool:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:  # an integer beyond the range of floats
        return False


def _range_text(above: float, at_least: float, at_most: float) -> str:
    bounds = []
    if above > -math.inf:
        bounds.append(f"above {above:g}")
    if at_least > -math.inf:
        bounds.append(f"at least {at_least:g}")
    if at_most < math.inf:
        bounds.append(f"at most {at_most:g}")
    return "a finite number" + (" " + " and ".join(bounds) if bounds else "")
