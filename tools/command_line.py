"""What the command lines of the tools have in common: how they end."""

import os
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from protocol.interrupts import ended_by_signals, said, status_after

_BAD_INPUT = 2


def ended(name: str, work: Callable[[], int], *expected: type[Exception]) -> int:
    """Run a command and return its exit status; expected failures, and those of files, are one line and status 2.

    Args:
        name: The command's, to begin that line with.
        work: Returns the exit status.
        expected: The errors that say what the user can do about them.
    """
    try:
        with ended_by_signals() as ending:
            status = work()
        if sys.stdout is not None:
            sys.stdout.flush()
    except KeyboardInterrupt as interrupt:
        print(f"{name}: {said(interrupt, 'interrupted')}", file=sys.stderr)
        return status_after(interrupt)
    except BrokenPipeError:
        _give_up_stdout()
        print(f"{name}: nobody reads what it prints any more", file=sys.stderr)
        return _BAD_INPUT
    except Exception as error:
        if not isinstance(error, (*expected, OSError)):
            raise
        _give_up_stdout()
        print(f"{name}: {said(error)}", file=sys.stderr)
        return ending.status(_BAD_INPUT)
    return ending.status(status)


def check_writable(path: Path) -> None:
    """Refuse a file that could not be written, before the work for it is done.

    Raises:
        OSError: Its folder is not there, is none, or may not be written to, or the path is a folder.
    """
    folder = path.parent
    if not folder.is_dir():
        raise NotADirectoryError(f"{folder} is not a folder")
    if not os.access(folder, os.W_OK):
        raise PermissionError(f"{folder} may not be written to")
    if path.is_dir():
        raise IsADirectoryError(f"{path} is a folder")


def check_folder(folder: Path) -> None:
    """Refuse a folder that could not be made or written to, before the work for it is done.

    Raises:
        OSError: It, or what it would be made in, is no folder or may not be written to.
    """
    nearest = next(parent for parent in (folder, *folder.absolute().parents) if parent.exists())
    if not nearest.is_dir():
        raise NotADirectoryError(f"{nearest} is not a folder")
    if not os.access(nearest, os.W_OK):
        raise PermissionError(f"{nearest} may not be written to")


def _give_up_stdout() -> None:
    """Let what is still to be printed go nowhere: else the interpreter complains of it again when it ends."""
    with suppress(OSError, ValueError, AttributeError):
        sys.stdout.flush()
        return
    with suppress(OSError, ValueError, AttributeError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
