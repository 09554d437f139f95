"""Progress of long work: one line on a terminal, erased at the end; no output to a pipe."""

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import TextIO

Progress = Callable[[int, int], None]
"""Called with the finished work and the total work, in any unit."""

ProgressOf = Callable[[str], Progress | None]
"""Gives the progress function for a kind of work."""

_WIPE = "\r\x1b[K"
_STEPS = 1000


def is_terminal(stream: TextIO | None) -> bool:
    """Return whether a stream is a terminal. A stream that was closed before the start is None."""
    return stream is not None and stream.isatty()


def shows_progress(stream: TextIO | None) -> bool:
    """Return whether a stream can replace the previous line."""
    return is_terminal(stream) and os.environ.get("TERM") != "dumb"


def show_line(text: str, stream: TextIO | None) -> None:
    """Replace the previous line, if the stream can. An empty line erases it."""
    if stream is not None and shows_progress(stream):
        with suppress(OSError):
            stream.write(_WIPE + text)
            stream.flush()


def progress_line(label: str, stream: TextIO | None) -> Progress | None:
    """Return the function to call with the finished and the total work, or None if `stream` cannot show progress."""
    if not shows_progress(stream):
        return None

    def show(done: int, total: int) -> None:
        show_line(f"{label} {done / total:4.0%}" if done < total else "", stream)

    return show


@contextmanager
def share_shown(label: str) -> Iterator[Callable[[float], None]]:
    """Give the function to call with the finished share (0..1) of the work.

    It shows the share on stderr, and erases it at the end.
    """
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
