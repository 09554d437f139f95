"""Progress of long work: one line on a terminal that is wiped when the work is done, and nothing in a pipe."""

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import TextIO

Progress = Callable[[int, int], None]
"""Called with the work done and all work, in any unit."""

ProgressOf = Callable[[str], Progress | None]
"""Gives the progress of a kind of work."""

_WIPE = "\r\x1b[K"
_STEPS = 1000


def is_terminal(stream: TextIO | None) -> bool:
    """Return whether a person is at a stream; one that was closed before the start is None."""
    return stream is not None and stream.isatty()


def shows_progress(stream: TextIO | None) -> bool:
    """Return whether a stream can show a line in place of the one before it."""
    return is_terminal(stream) and os.environ.get("TERM") != "dumb"


def show_line(text: str, stream: TextIO | None) -> None:
    """Show a line in place of the one before it, where the stream can; an empty one wipes it."""
    if stream is not None and shows_progress(stream):
        with suppress(OSError):
            stream.write(_WIPE + text)
            stream.flush()


def progress_line(label: str, stream: TextIO | None) -> Progress | None:
    """Return what to call with the work done and all work, or None where `stream` cannot show it."""
    if not shows_progress(stream):
        return None

    def show(done: int, total: int) -> None:
        show_line(f"{label} {done / total:4.0%}" if done < total else "", stream)

    return show


@contextmanager
def share_shown(label: str) -> Iterator[Callable[[float], None]]:
    """Give what to call with the share (0..1) of the work that is done; it is shown on stderr, and wiped in the end."""
    show = progress_line(label, sys.stderr)
    shown = -1

    def show_share(share: float) -> None:
        nonlocal shown
        step = round(_STEPS * share)
        if show is not None and step * 100 // _STEPS != shown:
            show(step, _STEPS)
            shown = step * 100 // _STEPS

    try:
        yield show_share
    finally:
        show_line("", sys.stderr)
