"""Write a file so that it appears when it is whole, or not at all."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def whole_file(file: Path) -> Iterator[Path]:
    """Give the path of a partial file to write; it is renamed to `file` in the end, or removed on any exception."""
    partial = file.with_name(f".{file.stem}.{os.getpid()}.partial{file.suffix}")
    try:
        yield partial
        partial.replace(file)
    finally:
        partial.unlink(missing_ok=True)


def write_whole(file: Path, text: str) -> None:
    """Write a text file that appears when it is whole."""
    with whole_file(file) as partial:
        partial.write_text(text, encoding="utf-8")
