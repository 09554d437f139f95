"""What the kit's command line says and asks."""

import sys

from protocol import ending
from protocol.conformance.bench.ports import is_simulated
from protocol.conformance.bench.wire import ReopenablePort
from protocol.conformance.profile.profile import Profile
from protocol.progress import is_terminal, show_line


class UsageError(Exception):
    """The command line cannot be carried out; the message says why."""


def say(sentence: str) -> None:
    """Tell the person at the terminal, if there is one."""
    ending.say("conformance", sentence)


def tell(text: str) -> None:
    """Print a result. When nobody reads results any more the work goes on: its files hold them all."""
    if sys.stdout is None:
        return
    encoding = sys.stdout.encoding or "utf-8"
    text = text.encode(encoding, "backslashreplace").decode(encoding)  # the name of a device may hold any byte
    try:
        sys.stdout.write(f"{text}\n")
        sys.stdout.flush()
    except OSError as error:
        if not isinstance(error, BrokenPipeError):  # as `| head` ends it
            say(f"stdout: {error.strerror}; no more is printed")
        ending.give_up_stdout()


def show_progress(text: str) -> None:
    """Show how far the work is, in place of what was shown before; on a terminal that can do so only."""
    show_line(text, sys.stderr)


def confirm(url: str, may_move: bool, profile: Profile, port: ReopenablePort) -> None:
    """Let nothing real move before somebody has agreed to how far and how fast.

    Raises:
        UsageError: nobody has.
    """
    if may_move or is_simulated(port):
        return
    limits = f"the table at {url} will turn {profile.motion}"
    if not is_terminal(sys.stdin):
        raise UsageError(f"{limits}; say --yes if it may")
    say(f"{limits}.")
    sys.stderr.write("Is its way free? Type yes to begin: ")
    sys.stderr.flush()
    if sys.stdin.readline().strip().lower() != "yes":
        raise UsageError("nothing was moved")
