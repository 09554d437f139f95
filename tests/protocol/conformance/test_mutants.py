"""Each case is shown to fail: it detects the wrong table that belongs to it, by name.

`test_suite` shows that a correct table passes all cases.
"""

import dataclasses

import pytest

from emulator.config.table_config import load_config
from protocol.conformance.bench.stand import STRICT, InProcess
from protocol.conformance.bench.wire import RecordedPort
from protocol.conformance.cases.catalog import all_cases, chosen_cases
from protocol.conformance.judgement.verdict import Verdict
from protocol.conformance.profile.profile import load_profile
from protocol.conformance.session.suite import Outcome, Session, SessionError
from tests.protocol.conformance.mutants import MUTANTS, Mutant, port_to

CATCHES_NONE = {
    "2.1/2": "with a table at another rate no session begins, as a test below shows",
}
"""Cases that no wrong table can fail, with the reason."""


def outcome_of(kind: type[Mutant], identifier: str) -> Outcome:
    """Run one case against a kind of table, in strict mode if the case needs that."""
    (case,) = chosen_cases([f"{identifier}$"])
    strict = STRICT in case.needs
    profile = load_profile()
    serial = dataclasses.replace(profile.serial, error_replies=not strict)
    port = port_to(kind, load_config().with_serial(strict=strict))
    session = Session(RecordedPort(port), dataclasses.replace(profile, serial=serial), InProcess(port.table))
    return session.run_case(case)


@pytest.mark.parametrize("wrong", MUTANTS)
def test_a_wrong_table_is_caught_by_name(wrong: str) -> None:
    case, kind = MUTANTS[wrong]
    outcome = outcome_of(kind, case)
    assert outcome.verdict is Verdict.FAIL, outcome.reason
    assert kind.says in outcome.reason


def test_each_case_catches_a_wrong_table() -> None:
    catching = {case for case, _ in MUTANTS.values()}
    assert {case.id for case in all_cases()} - catching == set(CATCHES_NONE)


def test_with_a_table_at_another_rate_no_session_begins() -> None:
    port = port_to(Mutant, load_config().with_serial(baud=19200))
    with pytest.raises(SessionError, match=r"check the power of the table, the cable, and the baud rate \(here 9600\)"):
        Session(RecordedPort(port), load_profile(), InProcess(port.table))
