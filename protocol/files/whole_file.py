"""A file that other programs may wait for: it appears when it is complete, or not at all."""

import logging
import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

_log = logging.getLogger(__name__)


@contextmanager
def whole_file(file: Path) -> Iterator[Path]:
    """Give the path of a partial file for writing.

    At the end it is renamed to `file`, or removed on any exception.

    The partial file is created here, exclusively: no other program writes it, and no symbolic link is followed.
    """
    partial = file.with_name(f".{file.stem}.{secrets.token_hex(4)}.partial{file.suffix}")
    os.close(os.open(partial, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666))
    try:
        yield partial
        partial.replace(file)
        _log.debug("wrote %s", file)
    finally:
        partial.unlink(missing_ok=True)


def write_whole(file: Path, text: str) -> None:
    """Write a text file that appears when it is complete."""
    with whole_file(file) as partial:
        partial.write_text(text, encoding="utf-8")
