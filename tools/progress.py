"""Progress of long work: a line on a terminal, nothing in a pipe."""

import sys
from types import TracebackType
from typing import Self


class Progress:
    """Shows a share of 0..1 as a percentage on stderr, if that is a terminal."""

    def __init__(self, title: str) -> None:
        """Name the work."""
        self._title = title
        self._on = sys.stderr.isatty()
        self._shown = -1

    def show(self, share: float) -> None:
        """Say how much is done."""
        percent = int(100.0 * share)
        if self._on and percent != self._shown:
            print(f"\r{self._title} {percent:3d} %", end="", file=sys.stderr, flush=True)
            self._shown = percent

    def __enter__(self) -> Self:
        """Begin."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """Leave the line empty."""
        if self._on and self._shown >= 0:
            print("\r\033[K", end="", file=sys.stderr, flush=True)
