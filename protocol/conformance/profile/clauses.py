"""The clauses of the specification. They are read from its page, so their text exists once."""

import re
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from typing import NamedTuple

_CLAUSE = re.compile(r"^- \*\*(\d+\.\d+/\d+)\*\* (must|should): (.+(?:\n  .+)*)$", re.MULTILINE)


class Clause(NamedTuple):
    """One numbered sentence of the specification; its level is `must` or `should`."""

    number: str
    level: str
    text: str


@cache
def specification() -> Mapping[str, Clause]:
    """Return every clause by its number, in the order of the page."""
    page = files("protocol.conformance.profile").joinpath("protocol.md").read_text(encoding="utf-8")
    return {number: Clause(number, level, " ".join(text.split())) for number, level, text in _CLAUSE.findall(page)}
