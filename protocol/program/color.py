"""Color of the words that matter most, such as a verdict: on a terminal only.

NO_COLOR switches it off, FORCE_COLOR on also in pipes, as in Python's own messages; see https://no-color.org.
"""

import os
from typing import Literal, TextIO

from protocol.program.progress import shows_progress

Kind = Literal["good", "bad"]

_SGR = {"good": "32", "bad": "31"}
"""The parameter of ECMA-48's SGR sequence: green and red."""


def has_color(stream: TextIO | None) -> bool:
    """Return whether words on a stream are colored."""
    if os.environ.get("NO_COLOR"):
        return False
    return bool(os.environ.get("FORCE_COLOR")) or shows_progress(stream)


def colored(text: str, kind: Kind, stream: TextIO | None) -> str:
    """Return the text as it is written to a stream."""
    return f"\x1b[{_SGR[kind]}m{text}\x1b[0m" if has_color(stream) else text
