"""Where the machine code of this package's source is kept between runs."""

import hashlib
import os
from functools import cache
from pathlib import Path


@cache
def machine_code_folder() -> Path:
    """Return the folder, which is named after the source of the whole package: any change of it compiles anew.

    It lies under numba's own cache folder where one is set (`NUMBA_CACHE_DIR`), else under the user's.
    """
    digest = hashlib.sha256()
    for source in sorted(Path(__file__).parents[1].rglob("*.py")):
        digest.update(source.name.encode() + b"\0" + source.read_bytes())
    user_cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "seventh-axis"
    return Path(os.environ.get("NUMBA_CACHE_DIR") or user_cache) / f"emulator-{digest.hexdigest()[:16]}"


def has_machine_code() -> bool:
    """Return whether something was compiled from this source already."""
    return any(machine_code_folder().rglob("*.nbc"))
