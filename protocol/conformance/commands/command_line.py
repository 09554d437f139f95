"""What the kit's command line prints, and what it asks the user."""

import sys

from protocol.conformance.bench.ports import is_simulated
from protocol.conformance.bench.wire import ReopenablePort
from protocol.conformance.profile.profile import Profile
from protocol.program import ending
from protocol.program.command_line import program_name, report, report_error
from protocol.program.progress import is_terminal, show_line


class UsageError(Exception):
    """The command line cannot be executed; the message states why."""


def say(sentence: str) -> None:
    """Print a line for the user, if the output is a terminal."""
    report(program_name("protocol.conformance"), sentence)


def say_error(problem: str) -> None:
    """Print in one line what is wrong."""
    report_error(program_name("protocol.conformance"), problem)


def tell(text: str) -> None:
    """Print a result. If the output is closed, the work continues: the files contain all results."""
    if sys.stdout is None:
        return
    encoding = sys.stdout.encoding or "utf-8"
    text = text.encode(encoding, "backslashreplace").decode(encoding)  # a device name may contain any byte
    try:
        sys.stdout.write(f"{text}\n")
        sys.stdout.flush()
    except OSError as error:
        if not isinstance(error, BrokenPipeError):  # `| head` closes it
            say(f"stdout: {error.strerror}; no more is printed")
        ending.give_up_stdout()


def show_progress(text: str) -> None:
    """Show the progress of the work in place of the previous line; only on a terminal that can replace a line."""
    show_line(text, sys.stderr)


def confirm(url: str, may_move: bool, profile: Profile, port: ReopenablePort) -> None:
    """Require that the user accepts how far and how fast a real table moves, before it moves.

    Raises:
        UsageError: the user did not accept.
    """
    if may_move or is_simulated(port):
        return
    limits = f"the table at {url} will turn {profile.motion}"
    if not is_terminal(sys.stdin):
        raise UsageError(f"{limits}; add --yes to allow this")
    say(f"{limits}.")
    sys.stderr.write("Is the table free to turn? Type yes to start: ")
    sys.stderr.flush()
    if sys.stdin.readline().strip().lower() != "yes":
        raise UsageError("the table was not moved")
