"""Files with what can be computed again, kept between runs for all checkouts and versions of a user.

A file's name says what it was computed from, so it is never stale, and any number of processes may write and read it at
once. What is read steers machines, and machine code runs without further checks: a file is used only if it is whole,
was written under its name, and belongs to this user, whom alone it lets write. Else, or where the folder cannot be read
or written, or is full, its content is computed again: that costs time only.
"""

import hashlib
import os
import stat
import time
from contextlib import suppress
from functools import cache
from pathlib import Path

from protocol.whole_file import whole_file

KERNEL = ".kernel"
FIELD = ".field"
UNUSED_DAYS = 60
"""A file that no run has used for so long is deleted when a new one is kept."""

_SUFFIXES = (KERNEL, FIELD, ".nbi", ".nbc", ".npz")
"""Of the files here, and in former layouts of the folder."""
_SEAL_BYTES = 32
_DAY_S = 86_400.0
_OPEN_FLAGS = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
"""Neither a link to elsewhere is followed, nor does a pipe keep the program waiting."""


def cache_root() -> Path:
    """Return the project's folder for what can be computed again.

    It lies under numba's own cache folder where one is set (`NUMBA_CACHE_DIR`), else under the user's.
    """
    user_cache = os.environ.get("NUMBA_CACHE_DIR") or os.environ.get("XDG_CACHE_HOME")
    try:
        return Path(user_cache or Path.home() / ".cache") / "seventh-axis"
    except RuntimeError:  # a user without a home, as in some containers: nothing is kept
        return Path(os.devnull, "seventh-axis")


def load_file(file: Path) -> bytes | None:
    """Return what was kept in a file; None where there is nothing, or nothing that can be trusted."""
    try:
        kept, used_s = _own_content(file)
    except OSError:
        return None
    seal, content = kept[:_SEAL_BYTES], kept[_SEAL_BYTES:]
    if seal != _seal(file.name, content):
        return None
    if time.time() - used_s > _DAY_S:
        with suppress(OSError):  # a folder that can only be read
            file.touch()
    return content


def keep_file(file: Path, content: bytes) -> None:
    """Keep what can be computed again in a file, if the folder allows it."""
    with suppress(OSError):
        file.parent.mkdir(parents=True, exist_ok=True)
        prune(cache_root())
        with whole_file(file) as partial:
            partial.chmod(0o600)
            partial.write_bytes(_seal(file.name, content) + content)


@cache
def prune(root: Path) -> None:
    """Delete files that no run has used for `UNUSED_DAYS`. Once in a process is enough."""
    for suffix in _SUFFIXES:
        for file in root.rglob(f"*{suffix}"):
            with suppress(OSError):
                if time.time() - file.stat().st_mtime > UNUSED_DAYS * _DAY_S:
                    file.unlink()


def _seal(name: str, content: bytes) -> bytes:
    """Return the digest that a file begins with: a file that was renamed, cut short or changed has another."""
    return hashlib.sha256(name.encode() + b"\0" + content).digest()


def _own_content(file: Path) -> tuple[bytes, float]:
    """Return what a file holds, and when it was last written or touched.

    Raises:
        OSError: It is not a plain file, or another user owns it or may write it.
    """
    with open(file, "rb", opener=lambda path, flags: os.open(path, flags | _OPEN_FLAGS)) as opened:
        status = os.fstat(opened.fileno())
        if not stat.S_ISREG(status.st_mode):
            raise PermissionError(f"{file}: not a plain file")
        if hasattr(os, "geteuid") and (status.st_uid != os.geteuid() or status.st_mode & 0o022):
            raise PermissionError(f"{file}: another user may have written it")
        return opened.read(), status.st_mtime
