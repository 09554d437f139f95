"""The suite under pytest: `pytest --pyargs protocol.conformance --table-port URL`."""

from collections.abc import Callable, Iterator

import pytest

from protocol.conformance.case import Case, all_cases
from protocol.conformance.host_watch import watch_in
from protocol.conformance.ports import is_simulated, open_port
from protocol.conformance.profile import ProfileError, load_profile
from protocol.conformance.stand import StandError, stand_beside
from protocol.conformance.suite import Session, SessionError
from protocol.conformance.verdict import Verdict
from protocol.conformance.wire import RecordedPort


@pytest.fixture(scope="module")
def session(pytestconfig: pytest.Config) -> Iterator[Session]:
    """A session with the table at `--table-port`; it ends with the table at rest where it was."""
    url = str(pytestconfig.getoption("--table-port"))
    try:
        profile = load_profile(pytestconfig.getoption("--table-profile"))
        port = open_port(url, profile)
        if not is_simulated(port) and not pytestconfig.getoption("--table-yes"):
            pytest.exit(f"the table at {url} would be moved; say --table-yes if its way is free", returncode=2)
        stand = stand_beside(port, pytestconfig.getoption("--table-control"), profile)
        with watch_in(simulated=is_simulated(port)) as watch:
            one = Session(RecordedPort(port), profile, stand, watch=watch)
            yield one
            one.end()
    except (ProfileError, SessionError, StandError) as error:
        pytest.exit(str(error), returncode=2)
    port.close()


@pytest.mark.parametrize("case", all_cases(), ids=lambda case: case.id)
def test_clause(session: Session, case: Case, record_property: Callable[[str, object], None]) -> None:
    """Hold the table against one clause."""
    outcome = session.run_case(case)
    for measurement in outcome.measurements:
        record_property(measurement.name, f"{measurement} {measurement.verdict}")
    if outcome.verdict is Verdict.SKIPPED:
        pytest.skip(outcome.reason)
    if outcome.verdict in {Verdict.FAIL, Verdict.ERROR}:
        pytest.fail(f"{outcome.reason}\n{case.clause.number} {case.clause.level}: {case.clause.text}", pytrace=False)
