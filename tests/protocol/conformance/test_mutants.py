"""Each deliberately wrong table is caught by the case that is there to catch it."""

import pytest

from protocol.conformance.case import chosen_cases
from protocol.conformance.profile import load_profile
from protocol.conformance.stand import InProcess
from protocol.conformance.suite import Outcome, Session
from protocol.conformance.verdict import Verdict
from protocol.conformance.wire import RecordedPort
from tests.protocol.conformance.mutants import MUTANTS, Mutant, port_to


def outcomes_of(kind: type[Mutant], prefix: str) -> list[Outcome]:
    port = port_to(kind)
    session = Session(RecordedPort(port), load_profile(), InProcess(port.table))
    return [session.run_case(case) for case in chosen_cases([prefix])]


@pytest.mark.parametrize("wrong", MUTANTS)
def test_a_wrong_table_is_caught_by_name(wrong: str) -> None:
    case, kind = MUTANTS[wrong]
    failed = [outcome.case.id for outcome in outcomes_of(kind, case) if outcome.verdict is Verdict.FAIL]
    assert any(one.partition(":")[0] == case for one in failed), wrong


@pytest.mark.parametrize("prefix", sorted({case for case, _ in MUTANTS.values()}))
def test_the_right_table_passes_the_case(prefix: str) -> None:
    assert {outcome.verdict for outcome in outcomes_of(Mutant, prefix)} == {Verdict.PASS}
