"""A run of the suite from the command line: print the verdicts and write the files."""

import argparse
import os
import shlex
import sys
from collections.abc import Callable, Sequence
from datetime import datetime
from functools import partial
from pathlib import Path

from protocol.clock import WallClock
from protocol.conformance.bench.host_watch import watch_in
from protocol.conformance.bench.ports import described, is_simulated
from protocol.conformance.bench.stand import stand_beside
from protocol.conformance.bench.wire import RecordedPort, ReopenablePort
from protocol.conformance.cases.case import Case
from protocol.conformance.cases.catalog import only
from protocol.conformance.commands.command_line import UsageError, confirm, say, say_error, show_progress, tell
from protocol.conformance.judgement.verdict import Verdict
from protocol.conformance.profile.profile import Profile
from protocol.conformance.results.record import Header, count_verdicts, write_junit, write_record
from protocol.conformance.results.report import write_report
from protocol.conformance.session.suite import Outcome, session_at
from protocol.program.color import colored
from protocol.program.command_line import program_name
from protocol.program.interrupts import status_after

_BAD = {Verdict.FAIL, Verdict.ERROR}
_NO_FILES = 2


def run_suite(options: argparse.Namespace, profile: Profile, port: ReopenablePort, cases: Sequence[Case]) -> int:
    """Run cases on the table at a port, write the record, the report and the JUnit XML, and return the exit status.

    Raises:
        UsageError: the files cannot be written, or the user did not accept the motion of the table.
        SessionError: the device at the port cannot be tested.
        BenchError: an operation on the bench failed.
    """
    junit = _junit_file(options)
    confirm(options.port, options.yes, profile, port)
    begun = None if is_simulated(port) else datetime.now().astimezone().isoformat(timespec="seconds")
    outcomes: list[Outcome] = []
    durations_s: list[float] = []
    status = 0
    with watch_in(simulated=is_simulated(port)) as watch:
        stand = stand_beside(port, options.control, profile)
        session = session_at(options.port, RecordedPort(port), profile, stand, options.seed, watch)
        header = Header(
            described(options.port),
            session.profile,
            options.seed,
            session.home_deg,
            sorted(session.capabilities),
            begun,
        )
        try:
            session.run(cases, _progress(outcomes, durations_s, len(cases), options))
        except KeyboardInterrupt as interrupt:
            status = status_after(interrupt)
            say(f"interrupted after {len(outcomes)} of {len(cases)} cases; {session.how_it_was_left}")
    is_good = not any(outcome.verdict in _BAD for outcome in outcomes)
    counts = ", ".join(f"{count} {verdict}" for verdict, count in count_verdicts(outcomes).items())
    tell(colored(counts, "good" if is_good else "bad", sys.stdout) if counts else "no case was run")
    written = _write(options, header, outcomes, durations_s, junit)
    return status or (int(not is_good) if written else _NO_FILES)


def _junit_file(options: argparse.Namespace) -> Path:
    """Return the path of the JUnit XML, after a check that all files can be written."""
    junit: Path = options.junit or options.out / "junit.xml"
    if junit.is_dir():
        raise UsageError(f"--junit {junit}: is a directory; name a file")
    if junit in {options.out / "record.json", options.out / "report.html"}:
        raise UsageError(f"--junit {junit}: is another output file of --out; choose another name")
    for directory in (options.out, junit.parent):
        try:
            directory.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise UsageError(f"{directory}: cannot create directory: {error.strerror}") from error
        if not os.access(directory, os.W_OK | os.X_OK):
            raise UsageError(f"{directory}: is not writable; choose another directory, or change its permissions")
    return junit


def _write(
    options: argparse.Namespace, header: Header, outcomes: Sequence[Outcome], durations_s: Sequence[float], junit: Path
) -> bool:
    """Write the files, and return whether all were written. A failure of one does not affect the others."""
    report = options.out / "report.html"
    writers = (
        partial(write_record, options.out / "record.json", header, outcomes),
        partial(write_junit, junit, header, outcomes, durations_s),
        partial(write_report, report, header, outcomes, partial(_repeat, options), options.command_line),
    )
    done = [_is_done(write) for write in writers]
    if all(done):
        say(f"report: {report}")
    return all(done)


def _is_done(write: Callable[[], None]) -> bool:
    try:
        write()
    except OSError as error:
        say_error(str(error))
        return False
    return True


def _progress(
    outcomes: list[Outcome], durations_s: list[float], total: int, options: argparse.Namespace
) -> Callable[[Outcome], None]:
    """Return the callback for each outcome. It prints those of interest, and the progress on a terminal.

    The real time of a case differs from the time of a simulated table, so it is stored beside the outcome.
    """
    clock = WallClock()
    last_s = clock.now_s()

    def take(outcome: Outcome) -> None:
        nonlocal last_s
        now_s = clock.now_s()
        outcomes.append(outcome)
        durations_s.append(now_s - last_s)
        last_s = now_s
        show_progress("")
        for run in outcome.spoiled:
            say(f"{outcome.case.id} was run again, since {run}")
        if outcome.verdict is not Verdict.PASS:
            tell(f"{_colored(outcome.verdict)} {outcome.case.id}: {outcome.reason}")
        if outcome.verdict in _BAD:
            tell(f"          {outcome.case.clause.level}: {outcome.case.clause.text}")
            tell(f"          To repeat: {_repeat(options, outcome.case)}")
        if len(outcomes) < total:
            show_progress(f"{len(outcomes)}/{total} {outcome.case.id}")

    return take


def _colored(verdict: Verdict) -> str:
    return colored(f"{verdict:9}", "bad", sys.stdout) if verdict in _BAD else f"{verdict:9}"


def _repeat(options: argparse.Namespace, case: Case) -> str:
    """Return the command that repeats one case alone."""
    words = [*program_name("protocol.conformance").split(), "--port", options.port]
    for name in ("profile", "control"):
        if getattr(options, name) is not None:
            words += [f"--{name}", str(getattr(options, name))]
    words += ["--case", only(case), "--seed", str(options.seed), "--out", str(options.out / "again")]
    return shlex.join(words + ["--yes"] * options.yes)
