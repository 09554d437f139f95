"""Run a program of the test bench and wait for its end."""

import os
import signal
import subprocess
from collections.abc import Sequence
from tempfile import TemporaryFile
from typing import IO

_MOST_SAID = 200
"""The number of characters shown from the end of a failing program's output."""


def failure_of(command: Sequence[str], timeout_s: float) -> str:
    """Run a program, and return in one line why it failed; an empty string for status 0.

    A program that exceeds its time is ended with all its children. Background processes of a successful program are not
    waited for.
    """
    with TemporaryFile() as said:  # a background process would keep a pipe open
        try:
            status = _status_of(command, said, timeout_s)
        except subprocess.TimeoutExpired:
            return f"did not end within {timeout_s:g} s and was ended"
        except OSError as error:
            return f"did not start: {error}"
        said.seek(0)
        return f"ended with status {status}{_quoted(said.read())}" if status else ""


def _status_of(command: Sequence[str], said: IO[bytes], timeout_s: float) -> int:
    with subprocess.Popen(  # noqa: S603 - the profile's own
        command, stdin=subprocess.DEVNULL, stdout=said, stderr=said, start_new_session=True
    ) as process:
        try:
            return process.wait(timeout_s)
        except BaseException:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
            raise


def _quoted(said: bytes) -> str:
    words = " ".join(said.decode(errors="replace").split())
    shortened = words if len(words) <= _MOST_SAID else f"... {words[-_MOST_SAID:]}"
    return f": {shortened}" if shortened else " without output"
