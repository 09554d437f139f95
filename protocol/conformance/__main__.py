"""The command line of the conformance kit: `python -m protocol.conformance --port URL --out DIR`."""

import argparse
import shlex
import sys
from collections.abc import Callable, Sequence
from datetime import datetime
from pathlib import Path
from typing import NoReturn

from protocol.conformance.case import Case, chosen_cases, only
from protocol.conformance.host_watch import watch_in
from protocol.conformance.ports import SessionError, described, is_simulated, open_port
from protocol.conformance.profile import Profile, ProfileError, load_profile
from protocol.conformance.record import Header, RecordError, count_verdicts, read_record, write_junit, write_record
from protocol.conformance.replay import replay
from protocol.conformance.report import write_report
from protocol.conformance.stand import Stand, StandError, stand_beside
from protocol.conformance.suite import Outcome, Session, session_at
from protocol.conformance.verdict import Verdict
from protocol.conformance.wire import RecordedPort, ReopenablePort, Wire

_EXAMPLE = """examples:
  python -m protocol.conformance --port emulator:// --out build/conformance
  python -m protocol.conformance --port /dev/ttyUSB0 --profile table.toml --case 7 --case 4.2/3 --out record

Exit status: 0 when no case failed, 1 when one did, 2 when the table could not be tested, 130 after Ctrl-C.
"""


_INTERRUPTED = 130


class UsageError(Exception):
    """The command line cannot be carried out; the message says why."""


class _Parser(argparse.ArgumentParser):
    """An argument parser whose errors are one line."""

    def error(self, message: str) -> NoReturn:
        raise UsageError(f"{message} (--help shows all options)")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit status."""
    try:
        options = _parser().parse_args(arguments)
        cases = _chosen(options.case)
        if options.list:
            return _list(cases)
        return _on_the_table(options, cases)
    except (UsageError, ProfileError, RecordError, SessionError, StandError, OSError) as error:
        _say(str(error))
        return 2
    except KeyboardInterrupt:
        _say("interrupted")
        return _INTERRUPTED


def _on_the_table(options: argparse.Namespace, cases: Sequence[Case]) -> int:
    if not options.port or not (options.out or options.replay):
        raise UsageError("give --port URL and --out DIR, or --list (--help shows all options)")
    profile = load_profile(options.profile)
    port = open_port(options.port, profile)
    try:
        if options.replay:
            return _replay(options, profile, port)
        return _run(options, profile, port, cases)
    finally:
        port.close()


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="python -m protocol.conformance",
        description="Hold a rotary table against the specification, clause by clause.",
        epilog=_EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    add = parser.add_argument
    add("--port", metavar="URL", help="the table: a device, or any URL of pyserial's")
    add(
        "--profile",
        metavar="FILE",
        type=Path,
        help="TOML file of what is known of this table (default: the stand-in's)",
    )
    add(
        "--case",
        metavar="PREFIX",
        action="append",
        default=[],
        help="only cases whose id begins so (with $ at the end: is so); may be repeated",
    )
    add("--control", metavar="PATH", type=Path, help="the control channel of a running stand-in")
    add("--out", metavar="DIR", type=Path, help="where record.json, report.html and junit.xml go")
    add("--junit", metavar="FILE", type=Path, help="where JUnit's XML goes instead")
    add("--seed", metavar="N", type=int, default=0, help="seed of what cases leave to chance (default 0)")
    add("--yes", action="store_true", help="the table may be moved as the profile says: do not ask")
    add("--list", action="store_true", help="show the cases and what each needs, and end")
    add("--replay", metavar="FILE", type=Path, help="send the wire of a record.json again, and show where answers part")
    return parser


def _chosen(prefixes: Sequence[str]) -> list[Case]:
    try:
        return chosen_cases(prefixes)
    except ValueError as error:
        raise UsageError(f"--case: {error}") from error


def _list(cases: Sequence[Case]) -> int:
    for case in cases:
        needs = f"  [needs {', '.join(sorted(case.needs))}]" if case.needs else ""
        turns = f"  [turns {case.travel_deg:g} deg]" if case.travel_deg else ""
        print(f"{case.id:18} {case.clause.level:6} {case.clause.text}{turns}{needs}")
    return 0


def _run(options: argparse.Namespace, profile: Profile, port: ReopenablePort, cases: Sequence[Case]) -> int:
    junit = options.junit or options.out / "junit.xml"
    for directory in (options.out, junit.parent):
        _make(directory)
    _confirm(options, profile, port)
    begun = None if is_simulated(port) else datetime.now().astimezone().isoformat(timespec="seconds")
    outcomes: list[Outcome] = []
    status = 0
    with watch_in(simulated=is_simulated(port)) as watch:
        stand = stand_beside(port, options.control, profile)
        session = session_at(options.port, RecordedPort(port), profile, stand, options.seed, watch)
        header = Header(
            described(options.port), profile, options.seed, session.home_deg, sorted(session.capabilities), begun
        )
        try:
            session.run(cases, _progress(outcomes, len(cases), options))
        except KeyboardInterrupt:
            status = _INTERRUPTED
            _say(f"interrupted after {len(outcomes)} of {len(cases)} cases; {_how_it_was_left(session)}")
    write_record(options.out / "record.json", header, outcomes)
    write_junit(junit, header, outcomes)
    write_report(options.out / "report.html", header, outcomes, lambda case: _repeat(options, case))
    print(", ".join(f"{count} {verdict}" for verdict, count in count_verdicts(outcomes).items()) or "nothing was run")
    _say(f"the report is {options.out / 'report.html'}")
    return status or int(any(outcome.verdict in {Verdict.FAIL, Verdict.ERROR} for outcome in outcomes))


def _make(directory: Path) -> None:
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(f"{directory}: is no directory and cannot become one: {error.strerror}") from error


def _progress(outcomes: list[Outcome], total: int, options: argparse.Namespace) -> Callable[[Outcome], None]:
    """Return what takes in each outcome: it prints those worth reading, and on a terminal shows how far the run is."""

    def take(outcome: Outcome) -> None:
        outcomes.append(outcome)
        if sys.stderr.isatty():
            sys.stderr.write(
                f"\r\x1b[K{len(outcomes)}/{total} {outcome.case.id}\r" if len(outcomes) < total else "\r\x1b[K"
            )
        for run in outcome.spoiled:
            _say(f"{outcome.case.id} was run again, since {run}")
        if outcome.verdict is Verdict.PASS:
            return
        print(f"{outcome.verdict:9} {outcome.case.id}: {outcome.reason}")
        if outcome.verdict in {Verdict.FAIL, Verdict.ERROR}:
            print(f"          {outcome.case.clause.level}: {outcome.case.clause.text}")
            print(f"          again: {_repeat(options, outcome.case)}", flush=True)

    return take


def _repeat(options: argparse.Namespace, case: Case) -> str:
    """Return the command that repeats one case alone."""
    words = ["python", "-m", "protocol.conformance", "--port", options.port]
    for name in ("profile", "control"):
        if getattr(options, name) is not None:
            words += [f"--{name}", str(getattr(options, name))]
    words += ["--case", only(case), "--seed", str(options.seed), "--out", str(options.out / "again")]
    return shlex.join(words + ["--yes"] * options.yes)


def _confirm(options: argparse.Namespace, profile: Profile, port: ReopenablePort) -> None:
    """Let nothing real move before somebody has agreed to how far and how fast."""
    if options.yes or is_simulated(port):
        return
    limits = f"the table at {options.port} will turn {profile.motion}"
    if not sys.stdin.isatty():
        raise UsageError(f"{limits}; say --yes if it may")
    _say(f"{limits}.")
    sys.stderr.write("Is its way free? Type yes to begin: ")
    sys.stderr.flush()
    if sys.stdin.readline().strip().lower() != "yes":
        raise UsageError("nothing was moved")


def _replay(options: argparse.Namespace, profile: Profile, port: ReopenablePort) -> int:
    record = read_record(options.replay)
    _check_reach(record.profile, profile, options.replay)
    stand: Stand = stand_beside(port, options.control, profile)
    _confirm(options, profile, port)
    recorded_port = RecordedPort(port)
    session = session_at(options.port, recorded_port, profile, stand)
    if session.home_deg != record.home_deg:
        raise SessionError(
            f"the table stands at {session.home_deg} deg, the record began at {record.home_deg}; bring it there first"
        )
    wanted = {case.id for case in _chosen(options.case)}
    wire, parted = Wire(recorded_port), 0
    try:
        for case in record.cases:
            if case.id in wanted and case.wire:
                parting = replay(case, wire, stand, profile)
                parted += parting is not None
                print(f"{'parts' if parting else 'same':9} {case.id}{f': {parting}' if parting else ''}", flush=True)
        session.end()
    except BaseException:
        session.stop()
        _say(_how_it_was_left(session))
        raise
    print(f"{parted} of {sum(case.id in wanted for case in record.cases)} cases part")
    return int(parted > 0)


def _how_it_was_left(session: Session) -> str:
    return "the table was stopped" if session.is_stopped else "the table does not answer: see to it that it has stopped"


def _check_reach(recorded: Profile, allowed: Profile, path: Path) -> None:
    """Refuse a record that moves a table farther or faster than this one may be moved."""
    for key in ("reach_deg", "speed_deg_s", "acceleration_deg_s2"):
        wanted, most = getattr(recorded.motion, key), getattr(allowed.motion, key)
        if wanted > most:
            raise UsageError(f"{path}: was recorded with motion.{key} {wanted:g}; the profile allows {most:g}")


def _say(sentence: str) -> None:
    print(f"conformance: {sentence}", file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main())
