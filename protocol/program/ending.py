"""How every command line ends: its exit status, and one line where something is wrong."""

import os
import sys
from collections.abc import Callable
from contextlib import suppress

from protocol.program.command_line import report_error
from protocol.program.interrupts import ended_by_signals, said, status_after

_BAD_INPUT = 2


def ended(name: str, work: Callable[[], int], *expected: type[Exception], interrupted: str = "interrupted") -> int:
    """Run a command and return its exit status. Expected errors, including those of files, are one line and status 2.

    Args:
        name: what the user typed for the program; that line starts with it, see `report_error`.
        work: returns the exit status.
        expected: the errors with a message for the user.
        interrupted: text of the line after a signal.
    """
    try:
        with ended_by_signals() as ending:
            status = work()
        if sys.stdout is not None:
            sys.stdout.flush()
    except KeyboardInterrupt as interrupt:
        report_error(name, said(interrupt, interrupted))
        return status_after(interrupt)
    except BrokenPipeError:
        give_up_stdout()
        report_error(name, "stdout is closed")
        return _BAD_INPUT
    except Exception as error:
        if not isinstance(error, (*expected, OSError)):
            raise
        give_up_stdout()
        report_error(name, said(error))
        return ending.status(_BAD_INPUT)
    return ending.status(status)


def give_up_stdout() -> None:
    """Discard the output that is not yet printed: else the interpreter reports the error again at its exit."""
    with suppress(OSError, ValueError, AttributeError):
        sys.stdout.flush()
        return
    with suppress(OSError, ValueError, AttributeError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)
