"""The effect of a fault of the line on the wire, and the reaction of the client."""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import serial

from protocol import PortError, ReplyTimeout, TableClient, TableError, UnexpectedReply
from tests.emulator.fault_bench import Bench


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


def test_a_line_that_gets_no_reply_does_not_use_up_a_fault_of_the_next_one() -> None:
    bench = Bench("emulator://?strict=1")
    bench.inject("half-reply", bytes=3)
    assert bench.raw(b"nonsense") == b""
    assert bench.raw(b"H") == b"H 0"


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
    with pytest.raises(serial.SerialException, match="the device has disappeared"):
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


@pytest.mark.realtime
def test_a_pulled_port_comes_back_under_its_link(start_emulator: Callable[..., Any], tmp_path: Path) -> None:
    link, control = tmp_path / "table", tmp_path / "control"
    running = start_emulator("--pty", "--link", str(link), "--control", str(control))
    with TableClient.open(str(link)) as client:
        assert client.position_deg() == 0.0
        command(control, "fault-hang-up", "--for-s", "0.3")
        with pytest.raises(TableError):
            read_often(client)
    running.wait_for_words("is available again")
    with TableClient.open(str(link)) as client:
        assert client.position_deg() == 0.0


@pytest.mark.realtime
def test_over_tcp_a_pulled_port_turns_clients_away(
    start_emulator: Callable[..., Any], tmp_path: Path, wait_until: Callable[[Callable[[], bool]], None]
) -> None:
    control = tmp_path / "control"
    running = start_emulator("--tcp", "0", "--control", str(control))
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
