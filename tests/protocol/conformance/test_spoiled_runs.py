"""A session on a machine with delays: affected cases are run again, and no table fails because of them."""

import dataclasses

import pytest

from emulator.faults import fault_from
from emulator.protocol_emulator import Serial
from protocol.conformance.bench.stand import InProcess
from protocol.conformance.bench.wire import RecordedPort
from protocol.conformance.cases import serial_line
from protocol.conformance.cases.case import Case
from protocol.conformance.cases.catalog import chosen_cases
from protocol.conformance.judgement.rig import Rig
from protocol.conformance.judgement.verdict import Verdict
from protocol.conformance.profile.profile import load_profile
from protocol.conformance.session.suite import Outcome, Session
from protocol.messages import ErrorCode
from tests.protocol.conformance.mutants import MUTANTS, Mutant, port_to


class BusyMachine:
    """A machine that is late in the first runs of a case and not late from then on."""

    def __init__(self, late_runs: int) -> None:
        self._runs_left = late_runs + 1  # the session's first question is one
        self.waits = 0

    def restart(self) -> None:
        self._runs_left -= 1

    def late_s(self) -> float:
        return 1.3 if self._runs_left >= 0 else 0.0

    def lap_s(self) -> float:
        return 0.0

    def wait_for_calm(self, allowed_s: float, patience_s: float) -> None:
        assert 0.0 < allowed_s < patience_s
        self.waits += 1


def failing_at_first(failures: int) -> Case:
    """A case that fails a correct table a given number of times, and then passes it."""
    left = [failures]

    def run(rig: Rig) -> None:
        rig.expect(b"S 5")
        left[0] -= 1
        rig.expect(b"A 5", b"OK" if left[0] < 0 else b"no reply at all")

    return dataclasses.replace(chosen_cases(["4.2/1"])[0], run=run)


def outcome_on(machine: BusyMachine, case: Case) -> Outcome:
    port = port_to(Mutant)
    session = Session(RecordedPort(port), load_profile(), InProcess(port.table), watch=machine)
    return session.run([case])[0]


def test_a_failure_on_a_machine_that_was_late_is_run_again() -> None:
    machine = BusyMachine(late_runs=2)

    outcome = outcome_on(machine, failing_at_first(2))

    assert outcome.verdict is Verdict.PASS
    assert outcome.spoiled == ("this machine was 1.3 s late: b'A 5' got b'OK', not b'no reply at all'",) * 2
    assert machine.waits == 2
    assert [event.data for event in outcome.wire].count(b"A 5\r") == 1  # the wire is that of the run that counts


def test_a_failure_on_a_punctual_machine_stands() -> None:
    outcome = outcome_on(BusyMachine(late_runs=0), failing_at_first(1))

    assert (outcome.verdict, outcome.spoiled) == (Verdict.FAIL, ())


def test_a_table_that_fails_once_its_machine_is_calm_fails() -> None:
    outcome = outcome_on(BusyMachine(late_runs=1), failing_at_first(9))

    assert outcome.verdict is Verdict.FAIL
    assert len(outcome.spoiled) == 1


def test_a_machine_that_is_never_calm_is_an_error_and_no_fault_of_the_table() -> None:
    outcome = outcome_on(BusyMachine(late_runs=9), failing_at_first(9))

    assert outcome.verdict is Verdict.ERROR
    assert outcome.reason.startswith("this machine was 1.3 s late: ")
    assert len(outcome.spoiled) == 4


def test_a_late_machine_does_not_make_a_pass_doubtful() -> None:
    outcome = outcome_on(BusyMachine(late_runs=9), failing_at_first(0))

    assert (outcome.verdict, outcome.spoiled) == (Verdict.PASS, ())


class LateInMotion(Mutant):
    """a reply in fifteen comes a fifth of a second late, as on a busy machine"""

    count = 0

    def _answer(self, line: bytes | ErrorCode) -> bytes:
        reply = super()._answer(line)
        self.count += 1
        if self.moving and self.count % 15 == 0:
            self.inject(fault_from("late-reply", {"seconds": 0.2}))
        return reply


@pytest.mark.parametrize("identifier", ["7.1/1$", "7.1/3$", "7.1/5$"])
def test_a_late_reading_tells_nothing_about_speed_and_acceleration(identifier: str) -> None:
    port = port_to(LateInMotion)
    session = Session(RecordedPort(port), load_profile(), InProcess(port.table))
    outcome = session.run_case(*chosen_cases([identifier]))
    assert outcome.verdict is not Verdict.FAIL, outcome.reason


class BusyWhileTheTableTurns(BusyMachine):
    """A machine without delays once the table is at rest."""

    def __init__(self, port: Serial) -> None:
        super().__init__(late_runs=0)
        self._port = port

    def wait_for_calm(self, allowed_s: float, patience_s: float) -> None:
        super().wait_for_calm(allowed_s, patience_s)
        self._port.clock.sleep_s(10.0)


def test_a_machine_that_is_late_at_the_first_question_asks_it_again() -> None:
    port = port_to(Mutant)
    port.write(b"P 20\r")  # a table in motion is refused
    watch = BusyWhileTheTableTurns(port)

    session = Session(RecordedPort(port), load_profile(), InProcess(port.table), watch=watch)

    assert session.home_deg == 20


def outcome_in_real_time(
    kind: type[Mutant], monkeypatch: pytest.MonkeyPatch, watch: BusyMachine | None = None
) -> Outcome:
    """Run the case that times replies as on a real line."""
    monkeypatch.setattr(serial_line, "is_simulated", lambda _: False)
    port = port_to(kind)
    session = Session(RecordedPort(port), load_profile(), InProcess(port.table), watch=watch)
    return session.run_case(*chosen_cases(["2.2/1$"]))


class LateOnce(Mutant):
    """one reply comes 30 ms late"""

    count = 0

    def _answer(self, line: bytes | ErrorCode) -> bytes:
        reply = super()._answer(line)
        self.count += 1
        if self.count == 300:
            self.inject(fault_from("late-reply", {"seconds": 0.03}))
        return reply


def test_a_table_that_is_late_regularly_is_found_in_real_time_too(monkeypatch: pytest.MonkeyPatch) -> None:
    _, late_at_times = MUTANTS["every 500th reply comes 30 ms late"]
    assert outcome_in_real_time(late_at_times, monkeypatch).verdict is Verdict.FAIL


def test_a_reply_that_is_late_once_is_left_to_the_testers_machine_in_real_time_alone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert outcome_in_real_time(LateOnce, monkeypatch).verdict is Verdict.PASS
    monkeypatch.undo()
    port = port_to(LateOnce)
    session = Session(RecordedPort(port), load_profile(), InProcess(port.table))
    assert session.run_case(*chosen_cases(["2.2/1$"])).verdict is Verdict.FAIL


class LateAtTimes(BusyMachine):
    """A machine that is late in every 50th exchange."""

    def __init__(self) -> None:
        super().__init__(late_runs=0)
        self.laps = 0

    def lap_s(self) -> float:
        self.laps += 1
        return 0.05 if self.laps % 100 == 0 else 0.0


def test_what_was_timed_on_a_late_machine_is_timed_again(monkeypatch: pytest.MonkeyPatch) -> None:
    machine = LateAtTimes()
    assert outcome_in_real_time(Mutant, monkeypatch, machine).verdict is Verdict.PASS
    assert machine.laps == 2 * (510 + 510 // 49)
