"""Run a program of this project as a separate process, even if another package has the same name."""

import os
import sys
from pathlib import Path

_HOME = Path(__file__).resolve().parents[2]
"""The folder of this project's packages."""


def own_program(module: str, *words: str) -> list[str]:
    """Return the command that runs a module of this project. The current folder is not on its path (`-P`)."""
    return [sys.executable, "-P", "-m", module, *words]


def own_environment() -> dict[str, str]:
    """Return the environment of the process: this project's packages precede those in PYTHONPATH."""
    path = [str(_HOME), *filter(None, [os.environ.get("PYTHONPATH")])]
    return os.environ | {"PYTHONPATH": os.pathsep.join(path), "PYTHONSAFEPATH": "1"}
