"""Ticks that pass at once, compiled or not, end in the states of a table that is observed tick by tick."""

import sys

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from emulator.config.table_config import TableConfig, load_config
from emulator.faults import fault_from
from emulator.table import fast_ticks
from emulator.table.fast_ticks import FastTicks
from emulator.table.table import Table
from emulator.table.tick import TableConstants, TableState

COMPILED = FastTicks(warm_up_ticks=0)
CONFIGS = [load_config().with_serial(baud=baud, decimals=3) for baud in (0, 300, 9600, 115_200, 4_000_000)]

LINES = st.sampled_from(b"H L S_40 S_3.3 A_100 A_7 P_0 P_12.3 R_-20 R_0 R_400 Q".split()).map(
    lambda line: line.replace(b"_", b" ") + b"\r"
) | st.sampled_from(
    [b"H", b"P 9", b"\r", b"\n", b"\xff", b"H\r" * 40, b"ERR" * 30, b"H" * 70 + b"\r", b"L\rH\rS 1\rH\r"]
)
STRONG_NM = st.sampled_from([0.0, 0.5, -1.5, 2.0, 30.0, -300.0])
FAULTS: st.SearchStrategy[tuple[str, dict[str, float]]] = st.sampled_from(
    [
        ("drop", {"probability": 0.2}),
        ("flip", {"probability": 0.2}),
        ("delay", {"seconds": 0.02}),
        ("half-reply", {"bytes": 3}),
        ("late-reply", {"seconds": 0.3}),
        ("silence", {}),
        ("hang-up", {"for_s": 0.1}),
        ("wrong-baud", {"baud": 4800}),
        ("stall", {"for_s": 0.2}),
        ("extra-load", {"torque_Nm": 3.0, "for_s": 0.1}),
        ("lost-counts", {"probability": 0.5}),
        ("bounced-trigger", {"edges": 5, "within_s": 0.05}),
        ("stuck-pwm", {"duty": 0.3, "for_s": 0.3, "at_command": 3}),
        ("swapped-encoder", {"for_s": 0.1, "at_s": 0.4}),
        ("dead-encoder", {"for_s": 0.2}),
    ]
)
DEEDS = st.one_of(
    st.tuples(st.just("receive"), LINES),
    st.tuples(st.just("advance"), st.integers(0, 30) | st.integers(0, 2000)),
    st.tuples(st.just("advance"), st.integers(0, 30) | st.integers(0, 2000)),
    st.tuples(st.just("load"), STRONG_NM),
    st.tuples(st.just("trigger"), st.floats(0.0, 0.999)),
    st.tuples(st.just("train"), st.sampled_from([0.0, 3.3, 130.0, 1000.0])),
    st.tuples(st.just("fault"), FAULTS),
    st.tuples(st.just("clear"), st.none()),
    st.tuples(st.just("reset"), st.sampled_from([0, 2**31 - 100, -(2**31)])),
    st.tuples(st.just("leave"), st.none()),
    st.tuples(st.just("status"), st.none()),
)


def do(table: Table, deed: str, what: object) -> object:  # noqa: C901  # a case for each action
    """Apply one action to a table, and return its observable state."""
    match deed, what:
        case "receive", bytes(data):
            table.receive(data)
        case "advance", int(ticks):
            table.advance(ticks)
        case "load", float(torque_Nm):
            table.set_load_torque(torque_Nm)
        case "trigger", float(fraction):
            table.trigger(fraction)
        case "train", float(rate_hz):
            table.trigger_hz = rate_hz
        case "fault", (str(kind), dict(numbers)):
            table.inject(fault_from(kind, numbers))
        case "clear", None:
            table.clear_faults()
        case "reset", int(count):
            table.reset(count)
        case "leave", None:
            table.disconnect()
        case "status", None:
            return table.status()
    return table.transmit()


def wires(table: Table) -> list[object]:
    uart = table.snapshot().serial.uart
    ways = (vars(uart)["_incoming"], vars(uart)["_outgoing"])
    return [(list(way.queue), vars(way)["_units"]) for way in ways] + [list(vars(uart)["_received"]), uart.lost_bytes]


def visible(table: Table) -> tuple[object, ...]:
    snapshot = table.snapshot()
    state = (snapshot.tick, snapshot.constants, snapshot.state, snapshot.registers, snapshot.load_torque_Nm)
    return repr(state), wires(table), table.status(), table.ticks_until_byte(), table.hung_up


@settings(max_examples=60)
@given(config=st.sampled_from(CONFIGS), seed=st.integers(0, 3), deeds=st.lists(DEEDS, max_size=40))
def test_compiled_stretches_leave_the_states_of_a_table_that_is_watched(
    config: TableConfig, seed: int, deeds: list[tuple[str, object]]
) -> None:
    watched, interpreted, compiled = Table(config, seed), Table(config, seed), Table(config, seed, run=COMPILED)
    watched.observer = lambda _status, _heard, _said: None
    for deed, what in deeds:
        seen = [do(table, deed, what) for table in (watched, interpreted, compiled)]
        assert seen[0] == seen[1] == seen[2], (deed, what)
    assert visible(watched) == visible(interpreted) == visible(compiled)


@pytest.mark.parametrize("config", CONFIGS, ids=lambda config: f"{config.serial.baud} baud")
@pytest.mark.parametrize("pause_ticks", [1, 13, 400])
def test_lines_that_pass_in_one_stretch_leave_the_wire_as_single_ticks_do(
    config: TableConfig, pause_ticks: int
) -> None:
    watched, compiled = Table(config), Table(config, run=COMPILED)
    watched.observer = lambda _status, _heard, _said: None
    for line in (b"H\r", b"P 5\rH\r", b"R -3", b"\r", b"H\r" * 40, b"L\rL\r"):
        for deed, what in (("receive", line), ("advance", pause_ticks), ("advance", 300)):
            assert do(watched, deed, what) == do(compiled, deed, what), (line, deed, what)
            assert visible(watched) == visible(compiled), (line, deed, what)


def moving_table(run: FastTicks) -> Table:
    table = Table(load_config().with_serial(baud=0), run=run)
    table.receive(b"S 40\rA 100\rR 3000\r")
    return table


def test_a_short_session_is_interpreted_and_a_long_one_compiled() -> None:
    run = FastTicks(warm_up_ticks=3000)
    table = moving_table(run)
    for _ in range(3):
        assert not run.is_compiled
        table.advance(1000)
        table.status()
    table.advance(1000)
    table.status()
    assert run.is_compiled


@pytest.mark.parametrize("kept", [False, True])
@pytest.mark.parametrize("loaded", [False, True])
def test_what_numba_still_has_to_do_is_weighed_against_what_ticks_have_cost(
    monkeypatch: pytest.MonkeyPatch, kept: bool, loaded: bool
) -> None:
    monkeypatch.setattr(fast_ticks, "is_kept", lambda _function: kept)
    if not loaded:
        monkeypatch.delitem(sys.modules, "numba", raising=False)
    run = FastTicks()
    table = moving_table(run)
    table.advance(fast_ticks.LOADED_TICKS)
    table.status()
    table.advance(fast_ticks.SHORT_TICKS)
    table.status()
    assert run.is_compiled == (kept and loaded)


def test_rest_costs_no_compilation() -> None:
    run = FastTicks(warm_up_ticks=20_000)
    table = Table(load_config().with_serial(baud=0), run=run)
    table.receive(b"R 1\r")
    table.advance(10**9)
    assert table.status().state == "idle"
    assert not run.is_compiled


def test_without_numba_everything_is_interpreted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fast_ticks, "find_spec", lambda _name: None)
    run = FastTicks(warm_up_ticks=0)
    table = moving_table(run)
    table.advance(2000)
    plain = moving_table(FastTicks(warm_up_ticks=10**9))
    plain.advance(2000)
    assert repr(table.snapshot().state) == repr(plain.snapshot().state)
    assert not run.is_compiled


def test_a_numba_that_cannot_keep_its_code_is_done_without(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "emulator.table.machine_code", None)
    run = FastTicks(warm_up_ticks=0)
    moving_table(run).advance(2000)
    assert not run.is_compiled


class Interrupting(FastTicks):
    """A run that Ctrl-C interrupts once, after its ticks."""

    is_armed = True

    def __call__(
        self, constants: TableConstants, state: TableState, load_torque_Nm: float, ticks: int
    ) -> tuple[TableState, bool]:
        """Run the ticks, and interrupt the first call."""
        passed = super().__call__(constants, state, load_torque_Nm, ticks)
        if self.is_armed:
            self.is_armed = False
            raise KeyboardInterrupt
        return passed


@pytest.mark.parametrize("warm_up_ticks", [0, sys.maxsize], ids=["compiled", "interpreted"])
def test_ctrl_c_leaves_a_table_that_makes_up_for_the_ticks_it_broke_off(warm_up_ticks: int) -> None:
    broken, sound = (Table(CONFIGS[0], run=run) for run in (Interrupting(warm_up_ticks), FastTicks(warm_up_ticks)))
    for table in (broken, sound):
        table.receive(b"P 30\r")
        table.advance(700)
    with pytest.raises(KeyboardInterrupt):
        broken.status()
    assert broken.status() == sound.status()
