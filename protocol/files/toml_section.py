"""A table of a TOML file as a frozen value, read by the fields of its dataclass.

A field is a number that `quantity` declares, a text, a tuple of texts, true or false, or a section itself.
"""

from collections.abc import Callable, Mapping
from dataclasses import field, fields, is_dataclass
from typing import Any, TypeVar, get_type_hints

from protocol.files.toml_table import TomlTable

_Section = TypeVar("_Section")


def quantity(**limits: float) -> Any:  # noqa: ANN401  # returned in place of a value of the annotated type
    """Declare a number with its limits: those of `TomlTable.number`, and of `TomlTable.count` for a whole number."""
    return field(metadata=limits)


def section(kind: type[_Section], table: TomlTable, defaults: Mapping[str, Any], **known: object) -> _Section:
    """Return what a table of a file states, as a value of `kind`.

    Args:
        kind: A dataclass.
        table: The table of the file.
        defaults: The values of the keys that the file leaves out; a key that is in neither is refused.
        known: Fields that have been read already.

    Raises:
        Exception: The error of `table`, for a key that is unknown or a value that is not allowed.
    """
    entries = fields(kind)  # type: ignore[arg-type]  # a dataclass
    table.only(*(entry.name for entry in entries))
    types = get_type_hints(kind)
    read = {
        entry.name: _value(types[entry.name], table, entry.name, defaults.get(entry.name), entry.metadata)
        for entry in entries
        if entry.name not in known
    }
    return kind(**read, **known)


def _value(wanted: Any, table: TomlTable, key: str, default: Any, limits: Mapping[str, Any]) -> object:  # noqa: ANN401  # a field's type and value
    if is_dataclass(wanted):
        return section(wanted, table.table(key), default or {})  # type: ignore[arg-type]  # a type, no instance
    readers: dict[object, Callable[..., object]] = {
        bool: table.switch,
        int: table.count,
        float: table.number,
        str: table.text,
    }
    return readers.get(wanted, table.texts)(key, default, **limits)
