"""End a program with one line on Ctrl-C during its imports. Each package with programs imports this module first.

The status is 130, without a traceback. A missing extra is reported in one line too, with status 2. This applies only to
a program of this project, started as `python -m planner ...` or `seventh-axis ...`. A program that imports these
packages as a library keeps its own signal handlers and exceptions.
"""

import os
import signal
import sys
from collections.abc import Sequence
from types import FrameType, TracebackType

_SCRIPT = "seventh-axis"
_PROGRAMS = ("emulator", "planner", "protocol", "seventh_axis", "tools", _SCRIPT)


def program_run(command: Sequence[str]) -> str:
    """Return the module that `python [OPTIONS] -m MODULE` runs, `seventh-axis` for that script, or nothing."""
    words = iter(command[1:])
    for word in words:
        if word == "-m":
            return next(words, "")
        if word in {"-W", "-X"}:
            next(words, None)
        elif not word.startswith("-") or word == "-c":
            file = word.replace("\\", "/").rpartition("/")[2].removesuffix(".exe")
            return _SCRIPT if file == _SCRIPT else ""
    return ""


def end_quietly(number: int, _: FrameType | None) -> None:
    """End the program at once: during the imports there is nothing to clean up."""
    os.write(2, f"{_PROGRAM}: interrupted\n".encode())
    os._exit(128 + number)


def end_without_extra(kind: type[BaseException], error: BaseException, traceback: TracebackType | None) -> None:
    """End the program with one line if an import did not find a module of an extra; else print the traceback."""
    from protocol.program.command_line import report_error  # noqa: PLC0415  # rarely needed, and the start should be fast
    from protocol.program.extras import missing_extra  # noqa: PLC0415

    if sentence := missing_extra(error, _PROGRAM, *sys.argv[1:2]):
        command = [word for word in sys.argv[1:2] if _PROGRAM == _SCRIPT and not word.startswith("-")]
        report_error(" ".join((_PROGRAM, *command)), sentence)
        raise SystemExit(2)
    sys.__excepthook__(kind, error, traceback)


_PROGRAM = program_run(sys.orig_argv)
IS_PROGRAM = _PROGRAM.partition(".")[0] in _PROGRAMS
"""Whether this process is a program of this project."""
if IS_PROGRAM:
    sys.excepthook = end_without_extra
# Ignored signals (nohup, `&` in a script) stay ignored.
if IS_PROGRAM and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
    signal.signal(signal.SIGINT, end_quietly)
