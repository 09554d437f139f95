"""Record which keys the planner's readers request from a TOML file, with the allowed values."""

import inspect
import json
import re
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any
from unittest.mock import patch

from protocol.files.data_file import DataFileError
from protocol.files.toml_table import TomlTable
from tools.reference.keys import Key

READERS = ("number", "count", "switch", "numbers", "text", "texts", "choice")
"""The methods of `TomlTable` that return a value."""


def recorded_keys(read: Callable[[], object]) -> dict[tuple[Path | str, str], Key]:
    """Return the keys that `read` asks for, by file and name; indices such as `joint[1]` are left out of names."""
    found: dict[tuple[Path | str, str], Key] = {}
    with ExitStack() as stack:
        for name in READERS:
            stack.enter_context(patch.object(TomlTable, name, _recording(getattr(TomlTable, name), found)))
        read()
    return found


def _recording(reader: Callable[..., Any], found: dict[tuple[Path | str, str], Key]) -> Callable[..., Any]:
    def recording(table: TomlTable, key: str, *arguments: object, **options: object) -> object:
        name = re.sub(r"\[\d+\]", "", table.name_of(key))
        bound = inspect.signature(reader).bind(table, key, *arguments, **options).arguments
        found.setdefault(
            (table.file, name),
            Key(name, _allowed(reader, key, arguments, options), _default(reader.__name__, bound), ""),
        )
        return reader(table, key, *arguments, **options)

    return recording


def _allowed(reader: Callable[..., Any], key: str, arguments: tuple[object, ...], options: dict[str, object]) -> str:
    """Return the content of the reader's own error message; no key may be a table."""
    try:
        reader(TomlTable(Path("probe"), {key: {}}), key, *arguments, **options)
    except DataFileError as error:
        return str(error).partition("; it must be ")[2]
    raise AssertionError(f"a table as the value of {key} is accepted")


def _default(reader: str, bound: dict[str, object]) -> str | None:
    default = bound.get("default")
    if reader == "texts":
        return "[]"  # such a list may always be omitted
    if isinstance(default, float):
        return f"{default:g}"
    return None if default is None else json.dumps(default).strip('"')
