"""Each fault shows at the wire, and client and firmware do about it what they should."""

import json
import math
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import serial
from hypothesis import given, settings
from hypothesis import strategies as st

from emulator.config import ConfigError, load_config
from emulator.control import COMMANDS
from emulator.faults import KINDS, FaultError, fault_from, parameters_of
from emulator.protocol_emulator import Serial
from emulator.table import Table
from emulator.tick import step
from protocol import PortError, ReplyTimeout, TableClient, TableError, UnexpectedReply

EXAMPLE: dict[str, dict[str, float]] = {
    "drop": {"probability": 0.3},
    "flip": {"probability": 0.1},
    "delay": {"seconds": 0.2},
    "half-reply": {"bytes": 3},
    "late-reply": {"seconds": 2.0},
    "silence": {},
    "hang-up": {"for_s": 2.0},
    "wrong-baud": {"baud": 4800},
    "stall": {},
    "extra-load": {"torque_Nm": 0.3},
    "supply-sag": {"supply_V": 3.0},
    "stuck-pwm": {"duty": 0.3},
    "one-sided": {"direction": 1},
    "lost-counts": {"probability": 0.1},
    "swapped-encoder": {},
    "dead-encoder": {},
    "missed-trigger": {"probability": 1.0},
    "bounced-trigger": {"edges": 3, "within_s": 0.02},
}


class Bench:
    """A table, its port, and a client that has found its place."""

    def __init__(self, url: str = "emulator://") -> None:
        self.port = Serial(url, timeout=1)
        self.table = self.port.table
        self.client = TableClient(self.port)
        self.client.position_deg()

    def inject(self, kind: str, **numbers: float) -> None:
        self.table.inject(fault_from(kind, numbers))

    def move(self, angle_deg: float, seconds: float = 5.0) -> None:
        self.client.set_speed(20)
        self.client.move_to(angle_deg)
        self.client.clock.sleep_s(seconds)

    def raw(self, line: bytes, seconds: float = 0.3) -> bytes:
        self.port.write(line + b"\r")
        self.client.clock.sleep_s(seconds)
        return self.port.read(self.port.in_waiting)


@pytest.fixture
def bench() -> Bench:
    return Bench()


def test_every_fault_has_an_example_here() -> None:
    assert EXAMPLE.keys() == KINDS.keys()


# The serial line


def test_dropped_bytes_cut_replies_and_the_client_takes_none_of_them_for_an_answer(bench: Bench) -> None:
    bench.inject("drop", probability=0.01)
    positions, failures = set(), 0
    for _ in range(60):
        try:
            positions.add(bench.client.position_deg())
        except TableError:
            failures += 1
    assert positions == {0.0}
    assert 2 < failures < 50
    bench.table.clear_faults()
    assert bench.client.position_deg() == 0.0


def test_flipped_bits_spoil_lines_and_most_do_not_pass_for_replies(bench: Bench) -> None:
    bench.inject("flip", probability=0.1)
    failures = 0
    for _ in range(40):
        try:
            bench.client.position_deg()
        except TableError:
            failures += 1
    assert failures > 10
    bench.table.clear_faults()
    assert bench.client.position_deg() == 0.0


@pytest.mark.parametrize(("direction", "reply"), [(1, b""), (-1, b""), (0, b"")])
def test_all_bytes_of_a_direction_can_be_lost(bench: Bench, direction: int, reply: bytes) -> None:
    bench.inject("drop", probability=1.0, direction=direction)
    assert bench.raw(b"P 10") == reply
    bench.table.clear_faults()
    bench.client.clock.sleep_s(5)
    assert bench.client.position_deg() == (10.0 if direction == -1 else 0.0)


def test_a_delay_makes_every_reply_later(bench: Bench) -> None:
    bench.inject("delay", seconds=0.2)
    for _ in range(3):
        begin_s = bench.client.clock.now_s()
        bench.client.position_deg()
        assert 0.2 < bench.client.clock.now_s() - begin_s < 0.23


def test_half_a_reply_is_a_missing_one_and_the_client_recovers(bench: Bench) -> None:
    bench.inject("half-reply", bytes=3)
    with pytest.raises(ReplyTimeout):
        bench.client.position_deg()
    assert bench.client.position_deg() == 0.0


def test_a_late_reply_is_never_the_answer_to_a_later_command(bench: Bench) -> None:
    bench.inject("late-reply", seconds=1.5)
    with pytest.raises(ReplyTimeout):
        bench.client.position_deg()
    bench.client.move_to(5)
    bench.client.wait_until_at(5)


def test_a_silent_table_carries_out_what_it_hears(bench: Bench) -> None:
    bench.inject("silence", for_s=3.0)
    with pytest.raises(ReplyTimeout):
        bench.client.move_to(5)
    bench.client.clock.sleep_s(3)
    assert bench.client.position_deg() == 5.0


def test_a_port_that_hung_up_is_dead_until_it_returns_and_the_motion_goes_on(bench: Bench) -> None:
    bench.client.move_to(5)
    bench.inject("hang-up", for_s=4.0)
    with pytest.raises(PortError):
        bench.client.position_deg()
    bench.port.close()
    with pytest.raises(serial.SerialException, match="the device has gone"):
        bench.port.open()
    bench.client.clock.sleep_s(4)
    bench.port.open()
    assert TableClient(bench.port).position_deg() == 5.0


def test_at_a_wrong_rate_both_ends_hear_garbage(bench: Bench) -> None:
    bench.inject("wrong-baud", baud=4800)
    assert bench.raw(b"H") != b"H 0.0\r"
    with pytest.raises((ReplyTimeout, UnexpectedReply)):
        bench.client.position_deg()
    bench.table.clear_faults()
    assert bench.client.position_deg() == 0.0


# The drive


def test_a_stalled_motor_is_switched_off_and_the_next_motion_starts_where_it_stands(bench: Bench) -> None:
    bench.client.set_speed(20)
    bench.client.move_to(40)
    bench.client.clock.sleep_s(1.0)
    bench.inject("stall")
    bench.client.clock.sleep_s(1.0)
    status = bench.table.status()
    assert (status.state, status.duty, status.speed_deg_s) == ("stalled", 0.0, 0.0)
    assert abs(status.current_A) < 1e-9
    bench.table.clear_faults()
    held = bench.client.position_deg()
    bench.client.move_by(5)
    bench.client.wait_until_at(held + 5, tolerance_deg=0.15)


def test_an_extra_load_costs_current_and_ends_with_its_time() -> None:
    currents = []
    for torque_Nm in (0.0, 0.3):
        bench = Bench()
        bench.inject("extra-load", torque_Nm=torque_Nm, for_s=1.5)
        bench.move(40, 1.4)
        currents.append(bench.table.status().current_A)
        bench.client.wait_until_at(40)
    # 0.3 Nm over the gears, with their losses, over the motor's torque constant.
    assert currents[1] - currents[0] == pytest.approx(0.3 / (480 * 0.6) / 23.4e-3, rel=0.2)


def test_with_a_sagging_supply_the_table_cannot_keep_its_speed(bench: Bench) -> None:
    bench.inject("supply-sag", supply_V=3.0)
    bench.move(60, 2.5)
    status = bench.table.status()
    assert status.duty == pytest.approx(1.0)
    assert 5.0 < status.speed_deg_s < 15.0  # a quarter of the no-load speed of 61 deg/s, less the friction's share


def test_a_stuck_bridge_drives_on_after_the_target(bench: Bench) -> None:
    bench.inject("stuck-pwm", duty=0.3, for_s=2.0)
    bench.client.clock.sleep_s(1.0)
    assert bench.table.status().speed_deg_s > 10.0
    bench.client.clock.sleep_s(2.0)
    assert bench.table.status().speed_deg_s == 0.0
    assert bench.client.position_deg() > 10.0


@pytest.mark.parametrize("direction", [1, -1])
def test_a_one_sided_bridge_cannot_go_the_other_way(direction: int) -> None:
    bench = Bench()
    bench.inject("one-sided", direction=direction)
    bench.move(-10 * direction)
    assert abs(bench.client.position_deg()) < 0.2
    bench.move(10 * direction)
    assert abs(bench.client.position_deg()) > 9.0


# The encoder


def test_lost_counts_turn_the_table_too_far_for_good(bench: Bench) -> None:
    bench.inject("lost-counts", probability=0.1)
    bench.move(20)
    bench.table.clear_faults()
    status = bench.table.status()
    assert bench.client.position_deg() == 20.0
    assert status.true_deg == pytest.approx(20 / 0.9, rel=0.02)
    before = status.true_deg - status.encoder_deg
    bench.move(10)
    after = bench.table.status()
    assert after.true_deg - after.encoder_deg == pytest.approx(before, abs=0.2)


def test_a_dead_encoder_ends_in_a_stall(bench: Bench) -> None:
    bench.inject("dead-encoder")
    bench.move(20)
    status = bench.table.status()
    assert (status.state, status.encoder_deg) == ("stalled", 0.0)
    assert status.true_deg > 5.0


def test_a_swapped_encoder_makes_the_table_run_away(bench: Bench) -> None:
    bench.inject("swapped-encoder")
    bench.move(20, 2.0)
    status = bench.table.status()
    assert status.true_deg == pytest.approx(-status.encoder_deg, abs=0.3)
    assert status.true_deg > 40.0


# The trigger


def test_a_missed_trigger_leaves_the_latch(bench: Bench) -> None:
    bench.move(10)
    bench.inject("missed-trigger", probability=1.0)
    bench.table.trigger()
    assert bench.client.latched_deg() == 0.0
    bench.table.clear_faults()
    bench.table.trigger()
    assert bench.client.latched_deg() == 10.0


@pytest.mark.parametrize("fraction", [0.0, 0.5])
def test_a_bounced_trigger_latches_a_later_position(fraction: float) -> None:
    bench = Bench()
    bench.move(60, 2.0)
    bench.inject("bounced-trigger", edges=3, within_s=0.2)
    at_edge = bench.table.status().encoder_deg
    bench.table.trigger(fraction)
    bench.client.clock.sleep_s(0.3)
    assert at_edge + 0.3 < bench.client.latched_deg() < at_edge + 4.1  # 0.2 s at 20 deg/s


# When


def test_a_fault_can_wait_for_its_time_and_end(bench: Bench) -> None:
    bench.inject("silence", at_s=2.0, for_s=1.0)
    silent = [not bench.raw(b"H", 0.3) for _ in range(12)]
    begin, end = silent.index(True), len(silent) - silent[::-1].index(True)
    assert all(silent[begin:end])
    assert 3 <= end - begin <= 4


def test_a_fault_can_wait_for_the_nth_command() -> None:
    port = Serial("emulator://", timeout=1)
    port.table.inject(fault_from("half-reply", {"bytes": 1, "at_command": 3}))
    replies = []
    for _ in range(4):
        port.write(b"H\r")
        replies.append(port.read_until(b"\r"))
    assert replies == [b"H 0.0\r", b"H 0.0\r", b"H", b"H 0.0\r"]


def test_faults_of_a_configuration_hold_from_the_start(tmp_path: Path) -> None:
    file = tmp_path / "faulty.toml"
    file.write_text(
        '[[faults]]\nfault = "silence"\nfor_s = 0.5\n\n[[faults]]\nfault = "half-reply"\nbytes = 2\nat_command = 2\n'
    )
    port = Serial(f"emulator://?config={file}", timeout=1)
    port.write(b"H\r")
    assert port.read(10) == b""
    port.write(b"H\r")
    assert port.read(10) == b"H "


@pytest.mark.parametrize("kind", KINDS)
def test_the_three_ways_take_the_same_names_and_numbers(kind: str, tmp_path: Path) -> None:
    numbers = EXAMPLE[kind] | {"at_s": 1.0}
    file = tmp_path / "faulty.toml"
    file.write_text(
        "[[faults]]\n" + "".join(f"{key} = {json.dumps(value)}\n" for key, value in {"fault": kind, **numbers}.items())
    )
    (from_file,) = load_config(file).faults
    got: list[Any] = []
    stand: Any = type("Stand", (), {"inject": lambda _, fault: got.append(fault)})()
    COMMANDS[f"fault-{kind}"].run(stand, numbers)
    assert got == [from_file] == [fault_from(kind, numbers)]


@pytest.mark.parametrize(
    ("kind", "numbers", "words"),
    [
        ("gremlins", {}, "'gremlins' is no fault; there are drop, "),
        ("drop", {}, "drop: probability is missing; it must be a number from 0 to 1"),
        ("drop", {"probability": 2}, "drop: probability is 2; it must be a number from 0 to 1"),
        ("drop", {"probability": math.nan}, "drop: probability is nan"),
        ("stall", {"force": 2}, "stall: force is not known; it takes at_s, at_command, for_s"),
        ("half-reply", {"bytes": 2, "for_s": 1}, "half-reply: for_s is not known"),
        ("stall", {"at_s": 1, "at_command": 1}, "stall: at_s and at_command are two beginnings"),
    ],
)
def test_what_is_no_fault_is_refused_in_one_line(
    kind: str, numbers: dict[str, float], words: str, tmp_path: Path
) -> None:
    with pytest.raises(FaultError, match=words):
        fault_from(kind, numbers)
    file = tmp_path / "faulty.toml"
    file.write_text(
        "[[faults]]\n"
        + "".join(f"{key} = {json.dumps(value).lower()}\n" for key, value in {"fault": kind, **numbers}.items())
    )
    with pytest.raises(ConfigError, match=f"faulty.toml: faults: {words}"):
        load_config(file)


def test_a_table_with_faults_repeats_itself_from_its_seed() -> None:
    def run(seed: int) -> bytes:
        table = Table(load_config(), seed)
        table.inject(fault_from("drop", {"probability": 0.3}))
        table.inject(fault_from("lost-counts", {"probability": 0.3}))
        for _ in range(20):
            table.receive(b"R 1\rH\r")
            table.advance(200)
        return table.transmit()

    assert run(1) == run(1) != run(2)


def test_a_snapshot_holds_the_faults_too() -> None:
    table = Table(load_config())
    table.inject(fault_from("lost-counts", {"probability": 0.3, "for_s": 1.0}))
    table.inject(fault_from("stall", {"at_s": 0.8}))
    table.receive(b"P 20\r")
    table.advance(500)
    snapshot = table.snapshot()
    futures = []
    for _ in range(2):
        table.restore(snapshot)
        table.advance(1000)
        futures.append(table.status())
    assert futures[0] == futures[1]
    assert futures[0].state == "stalled"


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32), ticks=st.integers(1, 300), target=st.integers(-50, 50))
def test_a_tick_of_a_fault_without_force_is_that_of_a_sound_table(seed: int, ticks: int, target: int) -> None:
    table = Table(load_config().with_serial(baud=0), seed)
    table.receive(b"P %d\r" % target)
    table.advance(ticks)
    constants, state = table.snapshot().constants, table.snapshot().state
    table.inject(fault_from("extra-load", {"torque_Nm": 0.0}))
    table.advance(1)
    assert table.snapshot().state == step(constants, state, 0.0)


# Over a real pty, the control channel and TCP


@pytest.mark.realtime
def test_a_pulled_port_comes_back_under_its_link(stand_in: Callable[..., Any], tmp_path: Path) -> None:
    link, control = tmp_path / "table", tmp_path / "control"
    running = stand_in("--pty", "--link", str(link), "--control", str(control))
    with TableClient.open(str(link)) as client:
        assert client.position_deg() == 0.0
        command(control, "fault-hang-up", "--for-s", "0.3")
        with pytest.raises(TableError):
            read_often(client)
    running.wait_for_words("has come back")
    with TableClient.open(str(link)) as client:
        assert client.position_deg() == 0.0


@pytest.mark.realtime
def test_over_tcp_a_pulled_port_turns_clients_away(
    stand_in: Callable[..., Any], tmp_path: Path, wait_until: Callable[[Callable[[], bool]], None]
) -> None:
    control = tmp_path / "control"
    running = stand_in("--tcp", "0", "--control", str(control))
    with TableClient.open(running.port) as client:
        assert client.position_deg() == 0.0
        command(control, "fault-hang-up")
        with pytest.raises(TableError):
            read_often(client)
    command(control, "clear-faults")

    def answers() -> bool:
        try:
            with TableClient.open(running.port, timeout_s=0.2) as client:
                return client.position_deg() == 0.0
        except TableError:
            return False

    wait_until(answers)


def read_often(client: TableClient) -> None:
    for _ in range(20):
        client.position_deg()


def command(control: Path, *words: str) -> None:
    subprocess.run([sys.executable, "-m", "emulator.control_client", str(control), *words], check=True, timeout=20)


def test_help_and_parameters_agree() -> None:
    for kind in KINDS:
        assert COMMANDS[f"fault-{kind}"].parameters == parameters_of(kind)
