"""A session with tables of every kind: right, strict, slow, absent, wrong."""

import dataclasses
import importlib
from collections.abc import Sequence
from pathlib import Path
from random import Random

import pytest
import serial

from emulator.config.table_config import load_config
from emulator.faults.fault import fault_from
from emulator.protocol_emulator import Serial
from protocol.conformance.bench.ports import SessionError
from protocol.conformance.bench.stand import InProcess, Stand, stand_beside
from protocol.conformance.bench.wire import RecordedPort, ReopenablePort, Wire
from protocol.conformance.cases.catalog import all_cases, chosen_cases
from protocol.conformance.cases.random_walk import SIMULATED, search, walk
from protocol.conformance.judgement.rig import Rig
from protocol.conformance.judgement.verdict import NonconformityError, Verdict
from protocol.conformance.profile.profile import Profile, load_profile
from protocol.conformance.session.suite import Outcome, Session
from tests.protocol.conformance.mutants import MUTANTS, Mutant, port_to


def run(url: str, profile: Profile, prefixes: Sequence[str] = (), seed: int = 0) -> list[Outcome]:
    port = Serial(url, baudrate=profile.serial.baud or 9600)
    session = Session(RecordedPort(port), profile, stand_beside(port, None, profile), seed)
    return session.run(chosen_cases(prefixes) if prefixes else all_cases())


def profile_with(tmp_path: Path, text: str) -> Profile:
    file = tmp_path / "table.toml"
    file.write_text(text)
    return load_profile(file)


def test_the_emulator_passes_every_case() -> None:
    outcomes = run("emulator://", load_profile())
    bad = [(outcome.case.id, outcome.reason) for outcome in outcomes if outcome.verdict is not Verdict.PASS]
    assert [case for case, _ in bad] == ["5.4/1", "5.4/2"], bad


@pytest.mark.parametrize(
    ("query", "serial_keys"),
    [
        ("strict=1", "error_replies = false"),
        ("decimals=3", "decimals = 3"),
        ("baud=115200", "baud = 115200"),
        ("baud=0", "baud = 0"),
    ],
)
def test_other_settings_of_the_line_conform_too(query: str, serial_keys: str, tmp_path: Path) -> None:
    profile = profile_with(tmp_path, f"[serial]\n{serial_keys}\n")
    outcomes = run(f"emulator://?{query}", profile, ["2", "3", "4.1", "5", "6", "8", "7.1/1"], seed=3)
    bad = [
        (outcome.case.id, outcome.reason) for outcome in outcomes if outcome.verdict in {Verdict.FAIL, Verdict.ERROR}
    ]
    assert bad == []


def test_a_table_in_process_is_asked_for_its_own_range(tmp_path: Path) -> None:
    file = tmp_path / "coarse.toml"
    file.write_text("[encoder]\nlines = 48\n")  # half as many as the profile's table has
    outcomes = run(f"emulator://?config={file}", load_profile(), ["4.4/2", "4.4/3", "6.1/2"])
    assert [outcome.reason for outcome in outcomes if outcome.verdict is not Verdict.PASS] == []


def test_the_same_seed_gives_the_same_bytes_at_the_same_times() -> None:
    first, second = (run("emulator://", load_profile(), ["7.3/7"], seed=5) for _ in range(2))
    assert [outcome.wire for outcome in first] == [outcome.wire for outcome in second]
    assert first[0].wire != run("emulator://", load_profile(), ["7.3/7"], seed=6)[0].wire


def test_a_session_ends_where_it_began() -> None:
    port = port_to(Mutant)
    port.write(b"P 33\r")
    port.clock.sleep_s(10)
    session = Session(RecordedPort(port), load_profile(), InProcess(port.table))
    session.run(chosen_cases(["7.1/1", "7.3/3"]))
    status = port.table.status()
    assert (status.state, round(status.encoder_deg, 1)) == ("idle", 33.0)


def test_an_interrupted_session_stops_the_table() -> None:
    port = port_to(Mutant)
    session = Session(RecordedPort(port), load_profile(), InProcess(port.table))
    with pytest.raises(KeyboardInterrupt):
        session.run([dataclasses.replace(chosen_cases(["7.1/1"])[0], run=interrupted)])
    status = port.table.status()
    assert status.state == "idle"
    assert 20 < status.encoder_deg < 60  # where it was, and not at home


def interrupted(rig: Rig) -> None:
    rig.move_to(300)
    rig.follow(1.0)
    raise KeyboardInterrupt


def test_an_interrupted_case_leaves_the_table_where_it_stopped_when_the_session_ends() -> None:
    port = port_to(Mutant)
    session = Session(RecordedPort(port), load_profile(), InProcess(port.table))
    with pytest.raises(KeyboardInterrupt):
        session.run_case(dataclasses.replace(chosen_cases(["7.1/1"])[0], run=interrupted))
    session.end()  # as pytest does, which ends its fixtures after Ctrl-C
    status = port.table.status()
    assert status.state == "idle"
    assert 20 < status.encoder_deg < 60


class InterruptedOnItsWay(RecordedPort):
    """Ctrl-C comes half a second after the command to return home."""

    def write(self, data: bytes, /) -> int | None:
        written = super().write(data)
        if data == b"P 0\r":
            self.clock.sleep_s(0.5)
            raise KeyboardInterrupt
        return written


def test_a_session_that_is_interrupted_on_its_way_home_stops_the_table() -> None:
    port = port_to(Mutant)
    session = Session(InterruptedOnItsWay(port), load_profile(), InProcess(port.table))

    def elsewhere(rig: Rig) -> None:
        rig.full_settings()
        rig.expect(b"P 60")
        rig.wait_for_rest()

    with pytest.raises(KeyboardInterrupt):
        session.run([dataclasses.replace(chosen_cases(["4.3/1"])[0], run=elsewhere)])
    status = port.table.status()
    assert status.state == "idle"
    assert 38 < status.encoder_deg < 41  # it was at 48, at 40 deg/s: the nearest point at which it can stand


@pytest.mark.parametrize(
    "motion",
    [
        "reach_deg = 90\nspeed_deg_s = 5\nacceleration_deg_s2 = 5",
        "reach_deg = 90\nspeed_deg_s = 5",
        "reach_deg = 90\nacceleration_deg_s2 = 10",
    ],
)
def test_a_right_table_that_may_only_be_moved_with_care_passes_too(motion: str, tmp_path: Path) -> None:
    profile = profile_with(tmp_path, f"[motion]\n{motion}\n")
    outcomes = run("emulator://", profile, ["4.1/5", "4.1/8", "4.1/11", "4.2/2", "6.1/3", "7.1", "7.3/5"])
    bad = [
        (outcome.case.id, outcome.reason) for outcome in outcomes if outcome.verdict in {Verdict.FAIL, Verdict.ERROR}
    ]
    assert bad == []


def test_a_table_that_does_not_answer_is_not_called_stopped() -> None:
    port = port_to(Mutant)
    session = Session(RecordedPort(port), load_profile(), InProcess(port.table))
    session.stop()
    assert session.is_stopped
    port.table.inject(fault_from("silence", {}))
    session.stop()
    assert not session.is_stopped


def test_what_a_table_lacks_is_skipped_with_its_reason(tmp_path: Path) -> None:
    profile = profile_with(
        tmp_path, "[motion]\nreach_deg = 10\n[waive]\n'5.2/4' = 'its printf'\n[rig]\nsees_disconnect = false\n"
    )
    port = Serial("emulator://")
    session = Session(RecordedPort(port), profile, Stand())
    reasons = {
        case.id: session.run_case(case).reason
        for case in all_cases()
        if case.id in {"3.1/5", "5.2/4", "6.2/1", "7.1/1"}
    }
    assert reasons == {
        "3.1/5": "a table that detects when its client disconnects not available",
        "5.2/4": "waived by the profile: its printf",
        "6.2/1": "a trigger input that the rig can drive not available",
        "7.1/1": "turns by 30 deg; the profile allows 10",
    }


def test_a_case_that_cannot_be_done_where_the_table_stands_is_skipped() -> None:
    port = port_to(Mutant)
    port.write(b"P 33\r")
    port.clock.sleep_s(10)
    session = Session(RecordedPort(port), load_profile(), InProcess(port.table))
    outcomes = session.run(chosen_cases(["5.2/5:motion", "7.2/1"]))
    assert [outcome.verdict for outcome in outcomes] == [Verdict.SKIPPED, Verdict.PASS]
    assert outcomes[0].reason == "the session began at 33 deg, not at 0"


def test_a_port_that_dies_is_an_error_of_the_case() -> None:
    port = port_to(Mutant)
    session = Session(RecordedPort(port), load_profile(), InProcess(port.table))
    port.table.inject(fault_from("hang-up", {"at_s": port.clock.now_s() + 0.5}))
    outcomes = session.run(chosen_cases(["7.1/1"]))
    assert [outcome.verdict for outcome in outcomes] == [Verdict.ERROR] * 2
    assert "the device has disappeared" in outcomes[0].reason


def test_a_silent_port_cannot_be_tested() -> None:
    port = port_to(Mutant)
    port.table.inject(fault_from("silence", {}))
    with pytest.raises(SessionError, match="no reply to 'H' within 1 s; check the power of the table"):
        Session(RecordedPort(port), load_profile(), InProcess(port.table))


def test_a_port_that_is_no_table_cannot_be_tested() -> None:
    port = RecordedPort(serial.serial_for_url("loop://"))
    with pytest.raises(SessionError, match="is not a table of this protocol"):
        Session(port, load_profile(), Stand())


def test_a_moving_table_cannot_be_tested() -> None:
    port = port_to(Mutant)
    port.write(b"P 300\r")
    with pytest.raises(SessionError, match="the table moves"):
        Session(RecordedPort(port), load_profile(), InProcess(port.table))


# Random walks


def rig_on(port: Serial, seed: int) -> Rig:
    profile = load_profile()
    return Rig(Wire(RecordedPort(port)), profile, InProcess(port.table), 0, Random(seed))  # noqa: S311 - no secret


@pytest.mark.parametrize("wrong", ["-0.0", "CAN is ignored, and the incomplete line is executed"])
def test_a_random_walk_finds_what_is_wrong_and_shrinks_it(wrong: str) -> None:
    found = first_failure([rig_on(port_to(MUTANTS[wrong][1]), seed) for seed in range(6)])
    steps = found.partition("; after ")[2].split(", ")
    assert 1 <= len(steps) <= 6, found


@pytest.mark.parametrize("wrong", ["S is lost in a motion", "A is lost in a motion"])
def test_every_random_walk_finds_a_setting_that_is_lost_in_a_motion(wrong: str) -> None:
    for seed in range(8):
        with pytest.raises(NonconformityError):
            search(rig_on(port_to(MUTANTS[wrong][1]), seed), seed, SIMULATED, NonconformityError)


def test_on_a_real_table_a_failing_walk_is_not_repeated_but_shrunk_on_the_emulator() -> None:
    rigs = [rig_on(port_to(MUTANTS["R counts from the old target"][1]), seed) for seed in range(8)]
    for rig in rigs:
        rig.wire.port.inner = UnclockedPort(rig.wire.port.inner)
    assert first_failure(rigs).endswith("the emulator passes the same walk")


def test_a_seed_gives_the_same_walk_whatever_else_is_imported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """hypothesis also draws the constants of the modules that it finds, here those of a user's own."""
    alone = traffic_of_walk(seed=5)
    (tmp_path / "module_of_a_user.py").write_text(f"NUMBERS = {[*range(100, 900)]}\n", encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    importlib.import_module("module_of_a_user")
    assert traffic_of_walk(seed=5) == alone
    assert traffic_of_walk(seed=6) != alone


def traffic_of_walk(seed: int) -> list[str]:
    rig = rig_on(Serial("emulator://"), seed)
    walk(rig)
    assert isinstance(rig.wire.port, RecordedPort)
    return [str(event) for event in rig.wire.port.events]


def first_failure(rigs: Sequence[Rig]) -> str:
    """Walk on one rig after the other until a walk fails, and return its message."""
    for rig in rigs:
        try:
            walk(rig)
        except NonconformityError as error:
            return str(error)
    pytest.fail("no walk found it")


class UnclockedPort:
    """A port to a simulated table without a clock of its own."""

    clock = None

    def __init__(self, port: ReopenablePort) -> None:
        self._port = port
        self.timeout = port.timeout

    @property
    def in_waiting(self) -> int:
        return self._port.in_waiting

    def read(self, size: int, /) -> bytes:
        self._port.timeout = self.timeout
        return self._port.read(size)

    def write(self, data: bytes, /) -> int | None:
        return self._port.write(data)

    def open(self) -> None:
        self._port.open()

    def close(self) -> None:
        self._port.close()


def test_the_default_profile_has_the_emulators_limits() -> None:
    profile, config = load_profile(), load_config()
    assert (profile.limits.speed_deg_s, profile.power_on.speed_deg_s) == (
        config.limits.speed_deg_s,
        config.power_on.speed_deg_s,
    )
    assert profile.table.counts_per_deg == config.counts_per_turn / 360
    assert (profile.serial.baud, profile.serial.decimals) == (config.serial.baud, config.serial.decimals)
