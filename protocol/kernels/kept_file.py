"""Files with what can be computed again, kept between runs for all checkouts and versions of a user.

A file's name identifies the input of its computation, so it is never stale. Any number of processes may write and read
it at once. The content controls machines, and machine code runs without further checks. So a file is used only if it is
complete, was written under its name, belongs to this user, and is not writable for others. Otherwise, or if the folder
cannot be used or is full, the content is computed again, which costs only time.
"""

import hashlib
import os
import stat
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path

from protocol.files.whole_file import whole_file

if sys.platform != "win32":  # there, several processes may make the same
    import fcntl

KERNEL = ".kernel"
FIELD = ".field"
UNUSED_DAYS = 60
"""A file that no run has used for so long is deleted when a new one is kept."""

_SUFFIXES = (KERNEL, FIELD, ".elf", ".so", ".lock", ".nbi", ".nbc", ".npz")
"""Of the files here, and in former layouts of the folder."""
PATIENCE_S = 60.0
"""How long to wait for another process that makes a file, but may have been suspended meanwhile."""
_LOOK_S = 0.02
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


@contextmanager
def made_by_one(file: Path) -> Iterator[None]:
    """Let one process at a time make a file; another one waits here, and should then look whether the file is there."""
    claim = file.with_name(f"{file.name}.lock")
    try:
        claim.parent.mkdir(parents=True, exist_ok=True)
        descriptor = os.open(claim, os.O_RDWR | os.O_CREAT | _OPEN_FLAGS, 0o600)
    except OSError:
        yield
        return
    try:
        _wait_for(descriptor)
        yield
    finally:
        with suppress(OSError):
            claim.unlink()
        os.close(descriptor)


def _wait_for(descriptor: int) -> None:
    end_s = time.monotonic() + PATIENCE_S
    while sys.platform != "win32" and time.monotonic() < end_s:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            time.sleep(_LOOK_S)
        except OSError:  # a file system without locks
            return
        else:
            return


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


def is_own(status: os.stat_result) -> bool:
    """Return whether a file is a plain one that belongs to this user, and that no other user can write."""
    is_ours = not hasattr(os, "geteuid") or (status.st_uid == os.geteuid() and not status.st_mode & 0o022)
    return is_ours and stat.S_ISREG(status.st_mode)


def _own_content(file: Path) -> tuple[bytes, float]:
    """Return what a file holds, and when it was last written or touched.

    Raises:
        OSError: It is not a plain file, or another user owns it or may write it.
    """
    with open(file, "rb", opener=lambda path, flags: os.open(path, flags | _OPEN_FLAGS)) as opened:
        status = os.fstat(opened.fileno())
        if not is_own(status):
            raise PermissionError(f"{file}: not a plain file, or another user may have written it")
        return opened.read(), status.st_mtime
