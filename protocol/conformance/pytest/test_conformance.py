"""The suite under pytest: `pytest --pyargs protocol.conformance --table-port URL`."""

import shlex
from collections.abc import Callable, Iterator
from contextlib import ExitStack

import pytest

from protocol.bench import BenchError
from protocol.conformance.bench.host_watch import watch_in
from protocol.conformance.bench.ports import SessionError, is_simulated, open_port
from protocol.conformance.bench.stand import stand_beside
from protocol.conformance.bench.wire import RecordedPort
from protocol.conformance.cases.case import Case
from protocol.conformance.cases.catalog import all_cases
from protocol.conformance.judgement.verdict import Verdict
from protocol.conformance.profile.profile import ProfileError, load_profile
from protocol.conformance.pytest.fixture import PTY, pty_emulator
from protocol.conformance.session.suite import Session, session_at
from protocol.program.interrupts import ended_by_signals


@pytest.fixture(scope="module")
def session(pytestconfig: pytest.Config, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Session]:
    """A session with the table at `--table-port`. At its end the table rests at its start position."""
    url, control = str(pytestconfig.getoption("--table-port")), pytestconfig.getoption("--table-control")
    may_move = pytestconfig.getoption("--table-yes") or url == PTY
    with ExitStack() as stack:
        if url == PTY:
            url, control = stack.enter_context(pty_emulator(tmp_path_factory.mktemp("table")))
        try:
            profile = load_profile(pytestconfig.getoption("--table-profile"))
            port = open_port(url, profile)
            stack.callback(port.close)
            stack.enter_context(ended_by_signals())
            if not may_move and not is_simulated(port):
                pytest.exit(
                    f"the table at {url} will turn {profile.motion}; add --table-yes to allow this", returncode=2
                )
            stand = stand_beside(port, control, profile)
            watch = stack.enter_context(watch_in(simulated=is_simulated(port)))
            one = session_at(url, RecordedPort(port), profile, stand, watch=watch)
        except (ProfileError, SessionError, BenchError) as error:
            pytest.exit(str(error), returncode=2)
        stack.callback(one.end)
        yield one


@pytest.mark.parametrize("case", all_cases(), ids=lambda case: case.id)
def test_clause(
    session: Session, case: Case, record_testsuite_property: Callable[[str, object], None], pytestconfig: pytest.Config
) -> None:
    """Test the table against one clause."""
    outcome = session.run_case(case)
    for measurement in outcome.measurements:
        # This belongs to the suite in the xunit2 format: a single test has no properties there.
        record_testsuite_property(f"{case.id}: {measurement.name}", f"{measurement} {measurement.verdict}")
    if outcome.verdict is Verdict.SKIPPED:
        pytest.skip(outcome.reason)
    if outcome.verdict in {Verdict.FAIL, Verdict.ERROR}:
        clause = f"{case.clause.number} {case.clause.level}: {case.clause.text}"
        pytest.fail(f"{outcome.reason}\n{clause}\nTo repeat: {_repeat(case, pytestconfig)}", pytrace=False)


def _repeat(case: Case, config: pytest.Config) -> str:
    """Return the command that repeats one case alone."""
    words = ["pytest", "--pyargs", "protocol.conformance", "--table-port", config.getoption("--table-port")]
    for name in ("--table-profile", "--table-control"):
        if config.getoption(name) is not None:
            words += [name, str(config.getoption(name))]
    return shlex.join([*words, *["--table-yes"] * config.getoption("--table-yes"), "-k", f"test_clause[{case.id}]"])
