"""Machine code that is kept between runs: a file for each function and the types of its arguments.

A file's name contains the digest of everything that determines the code (`code_digest`). So a change of the code gives
a new file, and a change of a comment does not.
"""

import sys
from collections.abc import Callable
from contextlib import AbstractContextManager
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from protocol.kernels.code_digest import NoDigestError, code_digest
from protocol.kernels.kept_file import KERNEL, cache_root, keep_file, load_file, made_by_one

_LAYOUT = "3"
"""Raised when machine code is made or written in another way: code of a former layout is then never loaded."""


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
    return name is not None and any(code_folder().glob(f"{name}-*{KERNEL}"))


def load_code(name: str) -> bytes | None:
    """Return the machine code that was kept under a name, or None."""
    return load_file(code_folder() / f"{name}{KERNEL}")


def keep_code(name: str, code: bytes) -> None:
    """Keep machine code under a name, if the folder allows it."""
    keep_file(code_folder() / f"{name}{KERNEL}", code)


def compiled_by_one(name: str) -> AbstractContextManager[None]:
    """Let one process at a time compile what is kept under a name; see `made_by_one`."""
    return made_by_one(code_folder() / f"{name}{KERNEL}")


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
