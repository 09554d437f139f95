"""Actions besides the wire: here the programs that a profile names, as for a real table."""

import json
import os
import select
import subprocess
import sys
from itertools import groupby
from pathlib import Path

import pytest

from emulator.table.table import Table
from protocol.bench import BenchError
from protocol.conformance.__main__ import main
from protocol.conformance.bench.stand import POWER_CYCLE, TRIGGER, Programs, Stand
from protocol.conformance.bench.wire import RecordedPort
from protocol.conformance.cases.catalog import chosen_cases
from protocol.conformance.judgement.verdict import Verdict
from protocol.conformance.profile.profile import load_profile
from protocol.conformance.pytest.fixture import RotaryTable
from protocol.conformance.session.suite import Outcome, Session
from tests.protocol.conformance.mutants import Mutant, port_to

NOTHING = ("true",)
FAILURE = ("sh", "-c", "echo the relay is stuck >&2; exit 3")


def outcomes_with(stand: Programs, *prefixes: str) -> tuple[list[Outcome], Mutant]:
    """Run cases on a correct table that stands at 33 deg; the rig has only programs."""
    port = port_to(Mutant)
    port.write(b"P 33\r")
    port.clock.sleep_s(10)
    outcomes = Session(RecordedPort(port), load_profile(), stand).run(chosen_cases(prefixes))
    assert isinstance(port.table, Mutant)
    return outcomes, port.table


def test_what_has_a_program_can_be_done() -> None:
    assert Programs(NOTHING, ()).capabilities == {TRIGGER}
    assert Programs((), NOTHING).capabilities == {POWER_CYCLE}
    assert Programs((), ()).capabilities == set()


@pytest.mark.parametrize(
    ("command", "sentence"),
    [
        (FAILURE, "rig.trigger_command, `sh -c 'echo the relay is stuck >&2; exit 3'`, ended with status 3: the relay"),
        (("false",), "rig.trigger_command, `false`, ended with status 1 without output"),
        (("sh", "-c", "kill -9 $$"), "ended with status -9"),
    ],
)
def test_a_program_that_fails_is_named_with_what_it_said(command: tuple[str, ...], sentence: str) -> None:
    with pytest.raises(BenchError) as caught:
        Programs(command, ()).trigger()
    assert sentence in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_program_that_does_not_end_is_ended_with_all_that_it_began(tmp_path: Path) -> None:
    fifo = tmp_path / "fifo"
    os.mkfifo(fifo)
    alive = os.open(fifo, os.O_RDONLY | os.O_NONBLOCK)
    try:
        with pytest.raises(BenchError, match=r"rig.power_cycle_command, `sh -c .*`, did not end within 0.3 s"):
            Programs((), ("sh", "-c", f"sleep 600 >{fifo} & wait"), timeout_s=0.3).power_cycle()
        assert select.select([alive], [], [], 10)[0], "the sleep goes on"
        assert os.read(alive, 1) == b""
    finally:
        os.close(alive)


def test_what_a_program_leaves_in_the_background_is_not_waited_for() -> None:
    Programs(("sh", "-c", "sleep 5 &"), (), timeout_s=2).trigger()


def test_a_program_that_is_not_there_is_told_before_anything_moves(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    profile = tmp_path / "table.toml"
    profile.write_text('[rig]\ntrigger_command = ["no-such-program", "17"]\n')
    words = ["--port", "loop://", "--yes", "--profile", str(profile), "--out", str(tmp_path / "out")]
    assert main(words) == 2
    said = capsys.readouterr().err
    assert "rig.trigger_command: program not found: 'no-such-program'" in said
    assert said.count("\n") == 1


def test_a_trigger_that_fails_is_an_error_and_the_table_goes_home() -> None:
    outcomes, table = outcomes_with(Programs(FAILURE, ()), "6.2/1$", "7.2/1")
    assert [outcome.verdict for outcome in outcomes] == [Verdict.ERROR, Verdict.PASS]
    assert "ended with status 3: the relay is stuck" in outcomes[0].reason
    status = table.status()
    assert (status.state, round(status.encoder_deg, 1)) == ("idle", 33.0)


def test_a_failing_trigger_leaves_the_next_case_a_table_at_rest() -> None:
    port = port_to(Mutant)
    session = Session(RecordedPort(port), load_profile(), Programs(FAILURE, ()))
    in_motion, at_rest = (chosen_cases([prefix])[0] for prefix in ("6.2/1", "4.2/4"))
    assert session.run_case(in_motion).verdict is Verdict.ERROR
    assert session.run_case(at_rest).verdict is Verdict.PASS


def test_a_power_switch_that_fails_leaves_home_where_it_is() -> None:
    outcomes, table = outcomes_with(Programs((), FAILURE), "4.6/5", "7.2/1")
    assert [outcome.verdict for outcome in outcomes] == [Verdict.ERROR, Verdict.PASS]
    assert round(table.status().encoder_deg, 1) == 33.0


class SwitchesAndFails(Stand):
    """A power switch that switches, and then fails."""

    capabilities = frozenset({POWER_CYCLE})

    def __init__(self, table: Table) -> None:
        self._table = table

    def power_cycle(self) -> None:
        self._table.reset()
        raise BenchError("the switch did not come back")


def test_a_power_switch_that_fails_when_it_is_done_makes_no_other_place_home() -> None:
    port = port_to(Mutant)
    port.write(b"P 33\r")
    port.clock.sleep_s(10)
    assert isinstance(port.table, Table)
    session = Session(RecordedPort(port), load_profile(), SwitchesAndFails(port.table))
    verdicts = [outcome.verdict for outcome in session.run(chosen_cases(["4.6/5", "7.2/1"]))]
    assert verdicts == [Verdict.ERROR, Verdict.PASS]
    assert round(port.table.status().encoder_deg, 1) == 0.0  # the former 33 deg are now 0


@pytest.mark.parametrize("case", ["6.2/1", "6.2/2", "4.3/2"])
def test_a_program_that_triggers_nothing_is_caught(case: str) -> None:
    assert outcomes_with(Programs(NOTHING, ()), case)[0][0].verdict is Verdict.FAIL


@pytest.mark.parametrize("case", ["4.6/5", "4.7/5", "6.1/5"])
def test_a_program_that_switches_nothing_is_caught(case: str) -> None:
    assert outcomes_with(Programs((), NOTHING), case)[0][0].verdict is Verdict.FAIL


def test_a_test_with_a_trigger_that_fails_is_not_skipped(tmp_path: Path) -> None:
    profile = tmp_path / "table.toml"
    profile.write_text('[rig]\ntrigger_command = ["false"]\n')
    table = RotaryTable("loop://", None, profile)
    with pytest.raises(pytest.fail.Exception, match=r"rig.trigger_command, `false`, ended with status 1"):
        table.trigger()
    with pytest.raises(pytest.skip.Exception, match="a way to switch the table off and on not available"):
        table.power_cycle()
    table.port.close()


@pytest.mark.realtime
def test_a_table_is_triggered_and_switched_by_programs_alone(tmp_path: Path) -> None:
    control = tmp_path / "control"
    client = [sys.executable, "-m", "emulator.control_client", str(control)]
    profile = tmp_path / "table.toml"
    profile.write_text(
        f"[rig]\ntrigger_command = {json.dumps([*client, 'trigger'])}\n"
        f"power_cycle_command = {json.dumps([*client, 'reset'])}\n"
    )
    start_emulator = [sys.executable, "-m", "emulator", "--tcp", "0", "--control", str(control)]
    with subprocess.Popen(start_emulator, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
        assert process.stdout is not None
        port = process.stdout.readline().strip()
        words = ["--port", port, "--profile", str(profile), "--yes", "--case", "6.1/5", "--case", "6.2/2"]
        try:
            assert main([*words, "--out", str(tmp_path / "out")]) == 0
        finally:
            process.terminate()
    record = json.loads((tmp_path / "out" / "record.json").read_text())
    deeds = [data for case in record["cases"] for _, way, data in case["wire"] if way == "beside"]
    assert [deed for deed, _ in groupby(deeds)] == ["trigger", "power_cycle", "trigger", "power_cycle"]
