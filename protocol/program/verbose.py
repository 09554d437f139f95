"""Debug messages of this project's packages on stderr, as the option -v of each command line asks.

The packages log through `logging`, each module under its own name, so that a program of one's own can collect them.
"""

import logging
import sys

from protocol.program.progress import show_line

PACKAGES = ("emulator", "planner", "protocol", "tools")


class _Lines(logging.StreamHandler):  # type: ignore[type-arg]  # generic for the type checker only
    """Writes each message as a line, in place of a progress line that is shown."""

    def emit(self, record: logging.LogRecord) -> None:
        show_line("", sys.stderr)
        super().emit(record)


def log_to_stderr() -> None:
    """Write all messages of this project from now on, with the time in s since the start of the program."""
    lines = _Lines(sys.stderr)
    lines.setFormatter(_Formatter("%(seconds)9.3f s %(name)s: %(message)s"))
    for package in PACKAGES:
        logger = logging.getLogger(package)
        logger.setLevel(logging.DEBUG)
        logger.handlers = [lines]


class _Formatter(logging.Formatter):
    def format(self, record: logging.LogRecord) -> str:
        record.seconds = record.relativeCreated / 1e3
        return super().format(record)
