"""The keys of a table's configuration file and of its faults, from the sections that read them."""

from collections.abc import Iterator
from dataclasses import Field, fields, is_dataclass
from typing import Any, get_type_hints

from emulator.config.table_config import DEFAULT_FILE, load_config
from emulator.faults.fault import KINDS, help_of, parameters_of
from emulator.faults.parameter import Parameter
from tools.reference.keys import Key, comments, key_page
from tools.reference.markdown import code, table

_INTRODUCTION = """A file for `python -m emulator --config` and for `emulator://?config=`. It needs only the keys
that
differ from the default table. The column "notes" shows the comment of the shipped file: often the source of a value."""


def table_page() -> str:
    """Return the page of the table's constants and of `[[faults]]`."""
    return key_page("Keys of a table", _INTRODUCTION, table_keys()) + "\n" + _faults()


def table_keys() -> list[Key]:
    """Return the keys of every section."""
    return list(_keys(load_config(), "", comments(DEFAULT_FILE.read_text(encoding="utf-8"))))


def _keys(section: Any, where: str, notes: dict[str, str]) -> Iterator[Key]:  # noqa: ANN401  # a section of any kind
    types = get_type_hints(type(section))
    for entry in fields(section):
        name, value = where + entry.name, getattr(section, entry.name)
        if is_dataclass(value):
            yield from _keys(value, f"{name}.", notes)
        elif not isinstance(value, tuple):  # the faults
            default = str(value).lower() if isinstance(value, bool) else f"{value:g}" if value < 1e5 else str(value)
            yield Key(name, _allowed(types[entry.name], entry), default, notes.get(name, ""))


def _allowed(kind: type, entry: "Field[Any]") -> str:
    if kind is bool:
        return "true or false"
    limits = entry.metadata
    bounds = [
        f"{words} {limits[key]:.10g}"
        for key, words in (("above", "above"), ("least", "at least"), ("most", "at most"))
        if limits[key] is not None
    ]
    what = "whole number" if kind is int else 'number, or a fraction such as "7/3"' if limits["fraction"] else "number"
    return f"{what}, {' and '.join(bounds)}"


def _faults() -> str:
    rows = [(code(kind), help_of(kind), "; ".join(map(_parameter, parameters_of(kind)))) for kind in KINDS]
    return "\n\n".join(
        (
            "## `[[faults]]`",
            "Each fault is one such section: its name in the key `fault`, and the keys below.",
            table(("`fault`", "effect", "keys"), rows),
        )
    )


def _parameter(entry: Parameter) -> str:
    return f"{code(entry.name)}: {entry.allowed}, {entry.help}"
