"""A replay from the command line: send a recorded session to another table, and print the differing replies."""

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from protocol.conformance.bench.ports import SessionError
from protocol.conformance.bench.stand import Stand, stand_beside
from protocol.conformance.bench.wire import RecordedPort, ReopenablePort, Wire
from protocol.conformance.cases.case import Case
from protocol.conformance.commands.command_line import UsageError, confirm, say, tell
from protocol.conformance.profile.profile import Profile
from protocol.conformance.results.record import Record, read_record
from protocol.conformance.results.replay import replay
from protocol.conformance.results.replay_check import Misfit, check
from protocol.conformance.session.suite import Session, session_at


def run_replay(options: argparse.Namespace, profile: Profile, port: ReopenablePort, cases: Sequence[Case]) -> int:
    """Send some recorded cases to the table at a port. Return 1 if a reply differs, else 0.

    Raises:
        RecordError: the file is not a record.
        UsageError: the file contains none of these cases, or they must not be sent to this table.
        SessionError: the device at the port cannot be tested, or is not at the recorded start position.
        BenchError: an operation on the bench failed.
    """
    record = _wanted(read_record(options.replay), cases, options.replay)
    _check_reach(record.profile, profile, options.replay)
    starts_deg = check(record.cases, record.home_deg, profile)
    if isinstance(starts_deg, Misfit):
        raise UsageError(f"{options.replay}: {starts_deg}; nothing was sent, choose other cases with --case")
    stand = stand_beside(port, options.control, profile)
    confirm(options.port, options.yes, profile, port)
    recorded_port = RecordedPort(port)
    session = session_at(options.port, recorded_port, profile, stand)
    if session.home_deg != record.home_deg:
        raise SessionError(
            f"the table stands at {session.home_deg} deg, the record began at {record.home_deg}; bring it there first"
        )
    try:
        differing = _send(record, starts_deg, session, Wire(recorded_port), stand, profile)
        session.end()
    except BaseException:
        session.stop()
        say(session.how_it_was_left)
        raise
    tell(f"{len(record.cases)} cases compared, {differing} differ")
    return int(differing > 0)


def _send(
    record: Record, starts_deg: Sequence[float], session: Session, wire: Wire, stand: Stand, profile: Profile
) -> int:
    """Move to the start of each case, replay it, and return how many cases differ.

    Raises:
        SessionError: the table is at another position because it executed a command that it must refuse, or it refused
            S or A.
    """
    differing = 0
    for case, start_deg in zip(record.cases, starts_deg, strict=True):
        session.begin_replay(case.id, start_deg)
        parting = replay(case, wire, stand, profile)
        differing += parting is not None
        tell(f"{'parts' if parting else 'same':9} {case.id}{f': {parting}' if parting else ''}")
    return differing


def _wanted(record: Record, cases: Sequence[Case], path: Path) -> Record:
    """Return the record with only the selected cases, without those that were skipped when it was made."""
    names = {case.id for case in cases}
    kept = tuple(case for case in record.cases if case.id in names and case.wire)
    if not kept:
        raise UsageError(f"{path}: contains no traffic of these cases; choose other cases with --case")
    return replace(record, cases=kept)


def _check_reach(recorded: Profile, allowed: Profile, path: Path) -> None:
    """Refuse a record that would move a table farther or faster than the profile allows."""
    for key in ("reach_deg", "speed_deg_s", "acceleration_deg_s2"):
        wanted, most = getattr(recorded.motion, key), getattr(allowed.motion, key)
        if wanted > most:
            raise UsageError(f"{path}: was recorded with motion.{key} {wanted:g}; the profile allows {most:g}")
