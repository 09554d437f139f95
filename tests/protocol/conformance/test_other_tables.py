"""Third-party tables: the kit passes unusual but conforming ones, and states what it cannot test."""

import dataclasses
from pathlib import Path

import pytest

from protocol.conformance.bench.stand import Stand
from protocol.conformance.bench.wire import RecordedPort
from protocol.conformance.cases.catalog import all_cases, chosen_cases
from protocol.conformance.judgement.verdict import Verdict
from protocol.conformance.profile.profile import load_profile
from protocol.conformance.session.suite import Outcome, Session
from tests.protocol.conformance.ideal_table import IdealPort, IdealTable, Make


def outcomes_of(make: Make, folder: Path, more: str = "", stand: Stand | None = None) -> list[Outcome]:
    file = folder / "table.toml"
    file.write_text(f"{make.profile}\n{more}")
    table = IdealTable(make)
    session = Session(RecordedPort(IdealPort(table)), load_profile(file), stand or table)
    return session.run(all_cases())


MAKES = {
    "silent when it refuses": Make(),
    "acts with its reply": Make(acts_after=1.0),
    "answers one line after the other": Make(is_busy_meanwhile=True, error_replies=True),
    "half a second away": Make(latency_s=0.5),
    "one decimal, ten counts to the degree": Make(decimals=1, counts_per_deg=10, acts_after=0.0),
    "six decimals": Make(decimals=6, error_replies=True),
    "300 baud": Make(baud=300, latency_s=0.01, error_replies=True),
    "an odd number of counts": Make(counts_per_deg=2731, latency_s=0.01),
    "slow": Make(top_speed=4.0, top_acceleration=3.0, error_replies=True),
    "fast": Make(top_speed=180.0, top_acceleration=400.0, latency_s=0.01, error_replies=True),
    "fast and far away": Make(top_speed=360.0, top_acceleration=2000.0),
}


@pytest.mark.parametrize("name", MAKES)
def test_a_right_table_of_another_make_passes(name: str, tmp_path: Path) -> None:
    outcomes = outcomes_of(MAKES[name], tmp_path)
    bad = [
        (outcome.case.id, outcome.reason) for outcome in outcomes if outcome.verdict in {Verdict.FAIL, Verdict.ERROR}
    ]
    assert bad == []


def test_a_coarse_encoder_on_a_slow_motion_is_not_taken_for_rest(tmp_path: Path) -> None:
    make = Make(latency_s=0.01)
    file = tmp_path / "table.toml"
    file.write_text(make.profile.partition("[motion]")[0] + "[motion]\nspeed_deg_s = 0.5\nacceleration_deg_s2 = 0.5\n")
    table = IdealTable(make)
    session = Session(RecordedPort(IdealPort(table)), load_profile(file), table)
    outcomes = session.run(chosen_cases(["4.1/5", "4.1/8", "4.5/2", "4.1/9"]))
    assert [outcome.reason for outcome in outcomes if outcome.verdict is not Verdict.PASS] == []


def test_a_table_that_is_only_slow_to_answer_fails_by_that_alone(tmp_path: Path) -> None:
    slow = Make(latency_s=0.08, is_busy_meanwhile=True, error_replies=True)
    outcomes = outcomes_of(dataclasses.replace(slow, profile_latency_s=0.01), tmp_path)
    assert [outcome.case.id for outcome in outcomes if outcome.verdict is Verdict.FAIL] == ["2.2/1"]


def test_what_such_a_table_lacks_is_said(tmp_path: Path) -> None:
    outcomes = outcomes_of(Make(), tmp_path, "[rig]\nsees_disconnect = false\n", Stand())
    reasons = {outcome.reason for outcome in outcomes if outcome.verdict is Verdict.SKIPPED}
    assert reasons == {
        "a trigger input that the rig can drive not available",
        "a way to switch the table off and on not available",
        "a way to preset the position counter not available",
        "a view of the encoder beside the wire not available",
        "a table that detects when its client disconnects not available",
        "error replies not available",
    }


@pytest.mark.parametrize("end", [b"\r\n", b" \r"])
def test_a_flaw_of_every_reply_is_called_by_its_own_clause_in_every_case(end: bytes, tmp_path: Path) -> None:
    outcomes = outcomes_of(Make(reply_end=end, error_replies=True, latency_s=0.01), tmp_path)
    failed = [outcome for outcome in outcomes if outcome.verdict is Verdict.FAIL]
    named = [outcome for outcome in failed if "clause 5.1/4" in outcome.reason]
    assert len(failed) > 90
    assert len(named) > 0.9 * len(failed), [outcome.reason for outcome in failed if outcome not in named]


def test_a_counter_without_halves_cannot_show_how_they_are_rounded(tmp_path: Path) -> None:
    (outcome,) = [one for one in outcomes_of(Make(), tmp_path) if one.case.id == "5.2/4"]
    assert (outcome.verdict, outcome.reason) == (
        Verdict.SKIPPED,
        "this counter has no count whose angle lies between two readings",
    )
