"""Progress of long work: one line on a terminal that is wiped when the work is done, and nothing in a pipe."""

from collections.abc import Callable
from typing import TextIO

Progress = Callable[[int, int], None]
"""Called with the work done and all work, in any unit."""

ProgressOf = Callable[[str], Progress | None]
"""Gives the progress of a kind of work."""

_WIPE = "\r\x1b[K"


def progress_line(label: str, stream: TextIO) -> Progress | None:
    """Return what to call with the work done and all work, or None where `stream` is no terminal."""
    if not stream.isatty():
        return None

    def show(done: int, total: int) -> None:
        line = f"{label} {done / total:4.0%}" if done < total else ""
        stream.write(_WIPE + line)
        stream.flush()

    return show
