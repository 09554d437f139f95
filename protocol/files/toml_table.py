"""Read a TOML file key by key, and refuse unknown keys.

Every refusal names the file, the key, its value and what is allowed: a typing error in a configuration must
never be a silent default. `toml_section` reads a whole table into a dataclass.
"""

import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from protocol.files.data_file import DataFileError, did_you_mean, read_toml, shortened, shown


class TomlTable:
    """One table of a TOML file, which records the keys that were read.

    Args:
        file: The file, or another source of the values.
        values: The values by their keys.
        prefix: The tables that this one is in, each with a point behind its name.
        error: What a refusal raises.
    """

    def __init__(
        self, file: Path | str, values: Mapping[str, Any], prefix: str = "", error: type[Exception] = DataFileError
    ) -> None:
        self.file = file
        self.values = values
        self._prefix = prefix
        self._error = error
        self._read: set[str] = set()

    @classmethod
    def load(cls, file: Path, error: type[Exception] = DataFileError) -> "TomlTable":
        """Return the top table of `file`; raises `error` where the file cannot be read or is not TOML."""
        try:
            return cls(file, read_toml(file), error=error)
        except DataFileError as unreadable:
            raise error(str(unreadable)) from unreadable

    def __contains__(self, key: str) -> bool:
        return key in self.values

    def name_of(self, key: str) -> str:
        """Return the full name of `key` with its tables, such as `cell.probe.stand_off_mm`."""
        return f"{self._prefix}{key}"

    def refuse(self, key: str, allowed: str) -> Exception:
        """Return the error with the value of `key` and the allowed values."""
        if key not in self.values:
            misspelt = self._misspelt(key)
            first = "" if misspelt is None else f"{self._prefix}{misspelt} is not a known key; did you mean {key}? "
            return self._error(f"{self.file}: {first}{self._prefix}{key} is missing; it must be {allowed}")
        return self._error(f"{self.file}: {self.name_of(key)} is {shown(self.values[key])}; it must be {allowed}")

    def _misspelt(self, key: str) -> str | None:
        """Return an unread key that is similar to a missing one."""
        unread = [other for other in self.values if other not in self._read]
        return next((other for other in unread if did_you_mean(shortened(other), [key])), None)

    def _unknown(self, key: str, *known: str) -> Exception:
        name = shortened(key)
        return self._error(
            f"{self.file}: {self._prefix}{name} is not a known key; known are {', '.join(sorted(known))}"
            f"{did_you_mean(name, known)}"
        )

    def _take(self, key: str, default: object = None) -> Any:  # noqa: ANN401 - any type until it is checked
        self._read.add(key)
        return self.values.get(key, default)

    def number(
        self,
        key: str,
        default: float | None = None,
        *,
        above: float = -math.inf,
        at_least: float = -math.inf,
        at_most: float = math.inf,
        fraction: bool = False,
    ) -> float:
        """Return the finite number `key` in (above, at_most] and [at_least, at_most]; required without a default.

        With `fraction`, a text such as `2197/27` is a number too.
        """
        value = self._take(key, default)
        if fraction and isinstance(value, str):
            value = _fraction_in(value)
        if not _is_number(value) or not (value > above and at_least <= value <= at_most):
            kind = 'a finite number, or a fraction such as "7/3",' if fraction else "a finite number"
            raise self.refuse(key, kind + _range_text(above, at_least, at_most))
        return float(value)

    def count(self, key: str, default: int | None = None, *, at_least: int, at_most: int) -> int:
        """Return the whole number `key` in [at_least, at_most]; required without a default."""
        value = self._take(key, default)
        if isinstance(value, bool) or not isinstance(value, int) or not at_least <= value <= at_most:
            raise self.refuse(key, f"a whole number from {at_least} to {at_most}")
        return value

    def switch(self, key: str, default: bool | None = None) -> bool:
        """Return the truth value `key`; required without a default."""
        value = self._take(key, default)
        if not isinstance(value, bool):
            raise self.refuse(key, "true or false")
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

    def texts(self, key: str, default: Sequence[str] | None = ()) -> tuple[str, ...]:
        """Return the list `key` of texts; a missing one is empty."""
        value = self._take(key, default)
        if not isinstance(value, list | tuple) or not all(isinstance(item, str) and item for item in value):
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
        if key not in self.values and (misspelt := self._misspelt(key)) is not None:
            raise self._unknown(misspelt, key)
        value = self._take(key, {})
        if not isinstance(value, dict):
            raise self.refuse(key, "a table")
        return self._inner(value, f"{key}.")

    def tables(self, key: str, count: int | None = None) -> "list[TomlTable]":
        """Return the tables of the list `key`: so many, or any number, also none."""
        value = self._take(key, [] if count is None else None)
        if not isinstance(value, list) or count not in {None, len(value)} or not _all_tables(value):
            raise self.refuse(key, "a list of tables" if count is None else f"a list of {count} tables")
        return [self._inner(item, f"{key}[{i + 1}].") for i, item in enumerate(value)]

    def one_or_more(self, key: str) -> "list[TomlTable]":
        """Return the table `key`, or the tables of the list `key`; a missing one is an empty table."""
        value = self.values.get(key)
        return self.tables(key) if isinstance(value, list) and value and _all_tables(value) else [self.table(key)]

    def _inner(self, values: Mapping[str, Any], name: str) -> "TomlTable":
        return TomlTable(self.file, values, self._prefix + name, self._error)

    def only(self, *known: str) -> None:
        """Refuse keys other than these, before a key is missing because of them.

        Raises:
            Exception: (the error of this table) The first such key, with those that are known here.
        """
        for key in self.values:
            if key not in known:
                raise self._unknown(key, *known)

    def finish(self) -> None:
        """Refuse keys that were not read.

        Raises:
            Exception: (the error of this table) One such key, with those that are known here.
        """
        self.only(*self._read)


def _all_tables(items: list[object]) -> bool:
    return all(isinstance(item, dict) for item in items)


def _fraction_in(text: str) -> float | None:
    """Return the number that a text such as `2197/27` states; None where it is not a fraction of integers."""
    parts = re.fullmatch(r"\s*([0-9]{1,10})\s*/\s*([0-9]{1,10})\s*", text)
    return int(parts[1]) / int(parts[2]) if parts and int(parts[2]) else None


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
        bounds.append(f"above {above:.10g}")
    if at_least > -math.inf:
        bounds.append(f"at least {at_least:.10g}")
    if at_most < math.inf:
        bounds.append(f"at most {at_most:.10g}")
    return " " + " and ".join(bounds) if bounds else ""
