"""Compile a numeric kernel with numba, and keep the machine code between runs.

Numba's own cache asks only whether the file of the *called* kernel has changed, so a kernel that calls one in
another file would keep running that file's old code. Here the cache's folder is named after the source of the whole
package: any change of it compiles anew.
"""

import hashlib
import os
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast

import numba

Function = TypeVar("Function", bound=Callable[..., Any])


@cache
def cache_directory() -> Path:
    """Return the folder of the machine code that belongs to this source.

    It lies under numba's own cache folder where one is set (`NUMBA_CACHE_DIR`), else under the user's.
    """
    digest = hashlib.sha256()
    package = Path(__file__).parent
    for source in sorted(package.rglob("*.py")):
        digest.update(str(source.relative_to(package)).encode() + b"\0" + source.read_bytes())
    user_cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "seventh-axis"
    return Path(os.environ.get("NUMBA_CACHE_DIR") or user_cache) / digest.hexdigest()[:16]


def kernel(function: Function) -> Function:
    """Return `function` compiled on its first call: no Python objects, no bounds checks, IEEE arithmetic.

    Floating-point results are those of the interpreted function to the last bit (no fast-math, no fused operations).
    """
    configured = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(cache_directory())
    try:
        compiled = numba.njit(cache=True, error_model="numpy", nogil=True)(function)
    finally:
        numba.config.CACHE_DIR = configured
    return cast("Function", compiled)
