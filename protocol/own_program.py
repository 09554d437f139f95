"""A program of this project as a process of its own, where no other package of the same name is run in its place."""

import os
import sys
from pathlib import Path

_HOME = Path(__file__).resolve().parents[1]
"""The folder of this project's packages."""


def own_program(module: str, *words: str) -> list[str]:
    """Return the command that runs a module of this project; the current folder is not on its path (`-P`)."""
    return [sys.executable, "-P", "-m", module, *words]


def own_environment() -> dict[str, str]:
    """Return the environment for it: this project's packages come before all that PYTHONPATH has."""
    path = [str(_HOME), *filter(None, [os.environ.get("PYTHONPATH")])]
    return os.environ | {"PYTHONPATH": os.pathsep.join(path), "PYTHONSAFEPATH": "1"}
