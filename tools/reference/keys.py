"""A key of a TOML file, as shown on its page."""

import re
from collections.abc import Iterable
from itertools import groupby
from typing import NamedTuple

from tools.reference.markdown import code, table
from tools.reference.units import unit


class Key(NamedTuple):
    """A key: its name with its sections, its allowed values, its default (None: required), and notes."""

    name: str
    allowed: str
    default: str | None
    notes: str


def key_page(title: str, introduction: str, keys: Iterable[Key]) -> str:
    """Return a page with a table for each section, in the order of the keys."""
    parts = [f"# {title}", introduction]
    for section, group in groupby(keys, key=lambda key: key.name.rpartition(".")[0]):
        parts += [f"## {code(f'[{section}]') if section else 'Outside of sections'}", _table(group)]
    return "\n\n".join(parts) + "\n"


def comments(toml: str) -> dict[str, str]:
    """Return the comment after each key of a TOML file, by the key's name with its section."""
    section, found = "", {}
    for line in toml.splitlines():
        if header := re.match(r"\[([\w.]+)\]", line):
            section = header[1]
        elif entry := re.match(r"(\w+) = [^#]*#\s*(.*)", line):
            found[f"{section}.{entry[1]}"] = entry[2]
    return found


def _table(keys: Iterable[Key]) -> str:
    rows = ((code(k.name.rpartition(".")[2]), unit(k.name), k.allowed, _default(k), k.notes) for k in keys)
    return table(("key", "unit", "allowed", "default", "notes"), rows)


def _default(key: Key) -> str:
    return "required" if key.default is None else code(key.default)
