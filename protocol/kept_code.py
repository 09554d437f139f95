"""Machine code that is kept between runs, for all checkouts and versions of a user: a file for each piece of it.

A file's name holds the digest of everything that the code was made from, so files are never stale, never rewritten with
something else, and any number of processes may write and read them at once. A folder that cannot be written, or is
full, costs time only: the code is compiled again in the next run.
"""

import hashlib
import os
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from protocol.code_digest import NoDigestError, code_digest
from protocol.whole_file import whole_file

_SUFFIX = ".kernel"
_DIGEST_BYTES = 32
_DAY_S = 86_400.0
_LAYOUT = "2"
"""Raised when machine code is made or written in another way: code of a former layout is then never loaded."""
UNUSED_DAYS = 60
"""Code that no run has used for so long is deleted when new code is kept."""


def cache_root() -> Path:
    """Return the project's folder for what can be computed again.

    It lies under numba's own cache folder where one is set (`NUMBA_CACHE_DIR`), else under the user's.
    """
    user_cache = os.environ.get("NUMBA_CACHE_DIR") or os.environ.get("XDG_CACHE_HOME")
    return Path(user_cache or Path.home() / ".cache") / "seventh-axis"


def code_folder() -> Path:
    """Return the folder of the machine code."""
    return cache_root() / "kernels"


def code_name(function: Callable[..., Any]) -> str | None:
    """Return how the names of the files with the machine code of a function begin; None where it cannot be kept.

    It is that of the present values of the globals that the function reads: numba takes them when it compiles.
    """
    try:
        digest = code_digest(function, *_versions())
    except NoDigestError:
        return None
    return f"{function.__module__}.{function.__qualname__}-{digest}".replace("<", "").replace(">", "")


def is_kept(function: Callable[..., Any]) -> bool:
    """Return whether there is machine code of a function, for any types of its arguments."""
    name = code_name(function)
    return name is not None and any(code_folder().glob(f"{name}-*{_SUFFIX}"))


def load_code(name: str) -> bytes | None:
    """Return what was kept under a name; None where there is nothing, or a damaged file."""
    file = code_folder() / f"{name}{_SUFFIX}"
    try:
        content = file.read_bytes()
        if time.time() - file.stat().st_mtime > _DAY_S:
            file.touch()
    except OSError:
        return None
    digest, code = content[:_DIGEST_BYTES], content[_DIGEST_BYTES:]
    return code if hashlib.sha256(code).digest() == digest else None


def keep_code(name: str, code: bytes) -> None:
    """Keep machine code under a name, if the folder allows it."""
    folder = code_folder()
    with suppress(OSError):
        folder.mkdir(parents=True, exist_ok=True)
        prune(cache_root())
        with whole_file(folder / f"{name}{_SUFFIX}") as partial:
            partial.write_bytes(hashlib.sha256(code).digest() + code)


@cache
def prune(root: Path) -> None:
    """Delete machine code that no run has used for `UNUSED_DAYS`, in former layouts of the folder too.

    Once in a process is enough.
    """
    for suffix in (_SUFFIX, ".nbi", ".nbc"):
        for file in root.rglob(f"*{suffix}"):
            with suppress(OSError):
                if time.time() - file.stat().st_mtime > UNUSED_DAYS * _DAY_S:
                    file.unlink()


@cache
def _versions() -> tuple[str, ...]:
    """Return the versions of what compiles the code and is called by it."""
    found = [_LAYOUT, sys.implementation.cache_tag or ""]
    for package in ("numba", "llvmlite", "numpy"):
        try:
            found.append(version(package))
        except PackageNotFoundError:
            found.append("")
    return tuple(found)
