"""Imported first by each package that holds programs: Ctrl-C during the imports ends them with one line.

The status is 130, and there is no traceback from whatever was being imported. Only a program of this project that was
started as `python -m planner ...` is ended so; one that imports these packages as a library keeps its own signals.
"""

import os
import signal
import sys
from collections.abc import Sequence
from types import FrameType

_PROGRAMS = ("emulator", "planner", "protocol", "tools")


def module_run(command: Sequence[str]) -> str:
    """Return the module that `python [OPTIONS] -m MODULE` runs, or nothing."""
    words = iter(command[1:])
    for word in words:
        if word == "-m":
            return next(words, "")
        if word in {"-W", "-X"}:
            next(words, None)
        elif not word.startswith("-") or word == "-c":
            break
    return ""


def end_quietly(number: int, _: FrameType | None) -> None:
    """End the program at once: during the imports there is nothing to put away."""
    os.write(2, f"{module_run(sys.orig_argv)}: interrupted\n".encode())
    os._exit(128 + number)


IS_PROGRAM = module_run(sys.orig_argv).partition(".")[0] in _PROGRAMS
"""Whether this process is a program of this project, and no other that uses it."""
# Ignored signals (nohup, `&` in a script) stay so.
if IS_PROGRAM and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
    signal.signal(signal.SIGINT, end_quietly)
