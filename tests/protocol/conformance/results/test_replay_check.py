"""The effect of a record on a table, computed before anything is sent."""

from collections.abc import Sequence
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol.conformance.bench.wire import Event
from protocol.conformance.profile.profile import Profile, load_profile
from protocol.conformance.results.record import RecordedCase
from protocol.conformance.results.replay_check import Misfit, check

REACH_DEG, SPEED, ACCELERATION = 5.0, 2.0, 10.0


@pytest.fixture(scope="module")
def careful(tmp_path_factory: pytest.TempPathFactory) -> Profile:
    """A table that may be moved by 5 deg each way."""
    file = tmp_path_factory.mktemp("profile") / "careful.toml"
    file.write_text(f"[motion]\nreach_deg = {REACH_DEG}\nspeed_deg_s = {SPEED}\nacceleration_deg_s2 = {ACCELERATION}\n")
    return load_profile(file)


def sent(*writes: bytes, every_s: float = 1.0) -> list[Event]:
    return [Event(index * every_s, "sent", data) for index, data in enumerate(writes)]


def beside(time_s: float, deed: bytes) -> Event:
    return Event(time_s, "beside", deed)


def found(profile: Profile, *cases: Sequence[Event], home_deg: float = 0.0) -> Misfit | list[float]:
    return check([RecordedCase(f"{index}", tuple(wire)) for index, wire in enumerate(cases)], home_deg, profile)


FITS = {
    "there and back": sent(b"S 2\r", b"A 10\r", b"P 5\r", b"P -5\r", b"P 0\r", every_s=6.0),
    "increments that cancel": sent(*[b"R 3\r", b"R -3\r"] * 5, every_s=6.0),
    "readings and refused lines": sent(b"H\r", b"L\r", b"?\r", b"\xff\r", b"P x\r", b"S 0\r", b"A -1\r", b"h\r"),
    "what no counter holds": sent(b"P 99999999999999\r", b"R 9999999999\r", b"P 4194304.1\r"),
    "a refused speed that moves nothing": sent(b"S 41\r", b"H\r"),
    "a new count for the same place": [
        *sent(b"P 1\r"),
        beside(9.0, b"preset 512000"),
        Event(10.0, "sent", b"S 2\rA 2\rP 1003\r"),
    ],
}


@pytest.mark.parametrize("name", FITS)
def test_what_fits_is_sent(name: str, careful: Profile) -> None:
    assert isinstance(found(careful, FITS[name]), list)


@pytest.mark.parametrize("second", [sent(b""), [Event(0.0, "received", b"H 1.0\r")], sent(b"H\r")])
def test_each_case_has_its_start_whether_it_has_lines_or_not(second: Sequence[Event], careful: Profile) -> None:
    wires = sent(b"P 1\r"), second, sent(b"P 2\r"), sent(b"H\r")
    assert found(careful, *wires) == [0.0, 1.0, 1.0, 2.0]
    cases = [RecordedCase("the same", tuple(wire)) for wire in wires]
    assert check(cases, 0.0, careful) == [0.0, 1.0, 1.0, 2.0]


MISFITS = {
    "too far": sent(b"P 5.1\r"),
    "too fast": sent(b"S 2.1\r"),
    "too hard": sent(b"A 10.1\r"),
    "far but soon pre-empted": sent(b"P 3000\r", b"P 0\r", every_s=0.1),
    "increments add up": sent(*[b"R 2\r"] * 3, every_s=5.0),
    "increments add up over pre-emptions": sent(*[b"R 4\r"] * 4, every_s=1.5),
    "LF within a number": sent(b"P \n3\n0\n0\n0\r"),
    "a line in pieces": sent(b"P", b" 30", b"00", b"\r"),
    "lines in one write": sent(b"H\rS 2\rP 3000\rH\r"),
    "spaces": sent(b"P    3000   \r"),
    "signs and zeros": sent(b"P +0003000.000\r"),
    "the fall from a slow braking": sent(b"P 5\r", b"A 0.01\r", b"P 4\r", every_s=0.9),
    "a small letter": sent(b"p 3000\r"),
    "a space before the letter": sent(b" P 3000\r"),
    "an exponent": sent(b"R 3e3\r"),
    "a comma": sent(b"P 3000,0\r"),
    "a hexadecimal number": sent(b"P 0xBB8\r"),
    "two numbers": sent(b"P 1 2\r"),
    "a bad byte amid the number": sent(b"P 3\x180\xff00\r"),
    "the eighth bit": sent(b"\xd0 3000\r"),
    "33 bytes": sent(b"P 3000".ljust(33) + b"\r"),
    "a number that begins beyond 32 bytes": sent(b"P" + b" " * 40 + b"3000\r"),
    "two commands in a line": sent(b"H P 3000\r"),
    "LF as the end of a line": sent(b"H\nP 3000\n\r"),
    "a refused speed before a motion": sent(b"S 41\r", b"P 1\r"),
    "a half line that a client left": [*sent(b"P 30"), beside(0.5, b"reopen"), Event(1.0, "sent", b"00\r")],
    "a power-on speed that is not allowed": [beside(0.0, b"power_cycle"), Event(1.0, "sent", b"P 1\r")],
    "switched off while it moves": [*sent(b"P 5\r"), beside(0.5, b"power_cycle")],
    "a new count, and the old place": [
        *sent(b"P 1\r"),
        beside(9.0, b"preset 512000"),
        Event(10.0, "sent", b"S 2\rA 2\rP 1\r"),
    ],
    "times that go back": [*sent(b"P 5\r", b"A 0.01\r", every_s=0.9), *sent(b"P 4\r")],
    "a flood that glues lines": sent(b"P 3\r" + b"H\r" * 60 + b"R 0.000\r" * 20),
    "a flood of many different lines": sent(b"".join(b"R 0.%02d\r" % number for number in range(90))),
}


@pytest.mark.parametrize("name", MISFITS)
def test_what_does_not_fit_is_named(name: str, careful: Profile) -> None:
    misfit = found(careful, FITS["there and back"], MISFITS[name])
    assert isinstance(misfit, Misfit), misfit
    assert misfit.case == "1"


def test_a_line_may_not_begin_in_one_case_and_end_in_the_next(careful: Profile) -> None:
    assert isinstance(found(careful, sent(b"P 30"), sent(b"00\r")), Misfit)


def test_positions_count_from_where_the_table_stands(careful: Profile) -> None:
    assert isinstance(found(careful, sent(b"P 363\r"), home_deg=360.0), list)
    assert isinstance(found(careful, sent(b"P 0\r"), home_deg=360.0), Misfit)


def test_each_case_begins_where_the_one_before_ended(careful: Profile) -> None:
    starts = found(careful, sent(b"P 3\r", b"H\r", every_s=9.0), sent(b"R -2\r", b"H\r", every_s=9.0), sent(b"H\r"))
    assert starts == [0.0, 3.0, 1.0]


def test_each_case_begins_at_rest(careful: Profile) -> None:
    assert found(careful, sent(b"P 3\r"), sent(b"R 1.5\r"), sent(b"H\r")) == [0.0, 3.0, 4.5]
    assert isinstance(found(careful, sent(b"P 3\r"), sent(b"R 3\r")), Misfit)


@given(st.lists(st.tuples(st.floats(-60.0, 60.0), st.floats(0.0, 2.0)), min_size=1, max_size=12))
def test_no_chain_of_increments_leaves_the_reach(moves: list[tuple[float, float]]) -> None:
    profile = load_profile(None)  # 400 deg each way
    time_s, wire = 0.0, []
    for increment_deg, wait_s in moves:
        wire.append(Event(time_s, "sent", b"R %.1f\r" % (10 * increment_deg)))
        time_s += wait_s
    farthest_deg = max(abs(10 * increment_deg) for increment_deg, _ in moves)
    if farthest_deg > 400.0:
        assert isinstance(found(profile, wire), Misfit)


def test_the_kits_own_record_fits(tmp_path: Path) -> None:
    from protocol.conformance.__main__ import main  # noqa: PLC0415 - for this test alone
    from protocol.conformance.results.record import read_record  # noqa: PLC0415

    cases = ("2.3", "3", "4.2", "4.5/1", "4.5/2", "4.5/3", "4.5/4", "4.6", "5", "6", "7.3", "8")
    words = [word for case in cases for word in ("--case", case)]
    assert main(["--port", "emulator://", *words, "--out", str(tmp_path)]) == 0
    record = read_record(tmp_path / "record.json")
    assert isinstance(check([case for case in record.cases if case.wire], record.home_deg, load_profile(None)), list)
