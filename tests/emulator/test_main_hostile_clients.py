"""Clients that misbehave or fail do not affect the emulator."""

import os
import random
import select
import subprocess
import sys
import time
from pathlib import Path

import pytest
import serial

from emulator import control_client
from tests.emulator.served import Start, WaitUntil, ask, open_port, wait_for_position

pytestmark = [
    pytest.mark.realtime,
    pytest.mark.skipif(sys.platform != "linux", reason="what is known about ptys was measured on Linux"),
]


def ask_after_reopening(port: serial.Serial) -> bytes:
    """Return the reply to H, sent again if the table received it together with the close of the port."""
    reply = ask(port, b"H")
    return ask(port, b"H") if reply == b"ERR 5 bad byte\r" else reply


def test_a_half_line_is_not_glued_to_the_next_clients_first(start_emulator: Start) -> None:
    table = start_emulator("--pty")
    half = os.open(table.port, os.O_RDWR | os.O_NOCTTY)
    os.write(half, b"P 9")
    os.close(half)
    time.sleep(0.1)
    after = os.open(table.port, os.O_RDWR | os.O_NOCTTY)
    os.write(after, b"0\r")
    reply = b""
    while not reply.endswith(b"\r"):  # bytes on the line when a client disconnects may reach the next one
        assert select.select([after], [], [], 10.0)[0]
        reply += os.read(after, 64)
    os.close(after)
    assert reply == b"ERR 1 unknown command\r"
    with open_port(table.port) as port:
        assert ask_after_reopening(port) == b"H 0.0\r"
        time.sleep(0.2)
        assert ask(port, b"H") == b"H 0.0\r"


HALVES = [
    (b"R 9", b"0\r"),
    (b"H\rR 9", b"0\rH\r"),
    (b"S 20\rR 9", b"0\r"),
    (b"R", b" 90\r"),
    (b"P 9", b"0\r\r"),
]
"""Bytes that one client leaves, and bytes that would complete them to a command."""


@pytest.mark.parametrize("baud", ["0", "9600"])
def test_half_a_command_is_never_finished_by_the_next_client_however_fast_it_comes(
    start_emulator: Start, tmp_path: Path, baud: str
) -> None:
    control = tmp_path / "control"
    table = start_emulator("--pty", "--baud", baud, "--control", str(control))
    chance = random.Random(int(baud))  # noqa: S311  # a test's draw
    for _ in range(60):
        first, second = chance.choice(HALVES)
        for data in (first, second):
            client = os.open(table.port, os.O_RDWR | os.O_NOCTTY)
            os.write(client, data)
            if data is first:
                time.sleep(chance.choice([0.0, 0.0, 0.0, 1e-5, 1e-4, 1e-3]))
                os.close(client)
                time.sleep(chance.choice([0.0, 0.0, 0.0, 1e-5, 1e-4, 1e-3]))
        reply = b""
        while b"ERR " not in reply or not reply.endswith(b"\r"):
            assert select.select([client], [], [], 10.0)[0]
            reply += os.read(client, 64)
        os.close(client)
        state = control_client.request(control, "state")
        assert (state["reference_deg"], state["state"]) == (0.0, "idle"), (first, second)


def test_a_client_may_come_and_go_many_times(start_emulator: Start) -> None:
    table = start_emulator("--pty", "--baud", "0")
    for _ in range(50):
        with open_port(table.port) as port:
            assert ask_after_reopening(port) == b"H 0.0\r"
    assert "two programs" not in table.stderr


def test_random_bytes_by_the_megabyte_move_nothing(
    start_emulator: Start, tmp_path: Path, wait_until: WaitUntil
) -> None:
    """Any bytes at any split: one reply per line, in order, and the running motion continues unchanged."""
    control = tmp_path / "control"
    table = start_emulator("--pty", "--baud", "0", "--time-scale", "0.01", "--control", str(control))
    chance = random.Random(1)  # noqa: S311  # not for security
    # Without the letters that could, by chance, be a command that is to be carried out.
    harmless = sorted(set(range(256)) - set(b"PRSA"))
    noise = bytes(chance.choices(harmless, k=1 << 20))
    lines = [line for line in noise.replace(b"\n", b"").split(b"\r") if line]
    received = bytearray()
    with open_port(table.port) as port:
        assert ask(port, b"P 40") == b"OK\r"
        port.timeout = 0
        position = 0
        while position < len(noise):
            size = chance.randint(1, 2000)
            port.write(noise[position : position + size])
            position += size
            received += port.read(65536)
        port.timeout = 10.0
        port.write(b"\r")
        while received.count(b"\r") < len(lines):
            received += port.read_until(b"\r")
        replies = bytes(received).split(b"\r")
        assert len(replies) == len(lines) + 1
        assert {reply[:5] for reply in replies} <= {b"H 0.0", b"L 0.0", b"ERR 1", b"ERR 2", b"ERR 4", b"ERR 5", b""}
        control_client.request(control, "time-scale", time_scale=50.0)
        wait_for_position(port, b"H 40.0\r", wait_until)


def test_an_unread_client_blocks_neither_commands_nor_others(start_emulator: Start, wait_until: WaitUntil) -> None:
    table = start_emulator("--pty", "--baud", "0", "--tcp", "0", "--time-scale", "20")
    url = table.next_line()
    deaf = os.open(table.port, os.O_RDWR | os.O_NOCTTY)
    os.write(deaf, b"P 10\r")
    for _ in range(20):
        os.write(deaf, b"Q\r" * 500)
    table.wait_for_words("does not read its replies")
    with open_port(url) as port:
        port.timeout = 0.5
        port.read(1 << 20)  # The replies to the other are received here too, as long as there are any.
        wait_until(lambda: ask(port, b"H") == b"H 10.0\r")
    assert "at the same time" in table.stderr
    os.close(deaf)


def test_a_client_that_floods_a_slow_line_is_made_to_wait_and_the_next_one_is_not_confused(
    start_emulator: Start,
) -> None:
    table = start_emulator("--pty", "--time-scale", "20")
    with open_port(table.port) as port:
        port.write_timeout = 0.2
        with pytest.raises(serial.SerialTimeoutException):
            port.write(b"L\r" * 100_000)
    time.sleep(0.1)
    with open_port(table.port) as port:
        assert ask(port, b"H") == b"H 0.0\r"


def test_a_terminal_that_echoes_does_not_make_the_table_answer_itself(start_emulator: Start, tmp_path: Path) -> None:
    control = tmp_path / "control"
    table = start_emulator("--pty", "--control", str(control))
    with open_port(table.port) as port:
        subprocess.run(["stty", "-F", table.port, "sane"], check=True)
        port.write(b"Q\r")
        table.wait_for_words("echo")
        time.sleep(0.5)
        subprocess.run(["stty", "-F", table.port, "raw", "-echo"], check=True)
        time.sleep(0.2)
        before = port.in_waiting
        time.sleep(0.2)
        assert port.in_waiting == before
    state = control_client.request(control, "state")
    assert (state["received_queue"], state["transmit_queue"]) == (0, 0)


def test_a_wrong_rate_is_garbage_and_stderr_says_why(start_emulator: Start) -> None:
    table = start_emulator("--pty")
    with open_port(table.port, 4800) as port:
        port.write(b"P 90\r")
        table.wait_for_words("set to 4800 baud and the table to 9600")
        time.sleep(0.2)
    with open_port(table.port) as port:
        time.sleep(0.1)  # the close and the first line in one look would make it ERR 5
        assert ask(port, b"H") == b"H 0.0\r"


def test_a_client_that_is_killed_in_mid_line_leaves_a_working_table(start_emulator: Start) -> None:
    table = start_emulator("--pty")
    script = f"exec 3<>{table.port}; printf 'P 1' >&3; echo; read never_comes <&3"
    with subprocess.Popen(["sh", "-c", script], stdout=subprocess.PIPE) as client:
        assert client.stdout is not None
        client.stdout.readline()
        client.kill()
    with open_port(table.port) as port:
        time.sleep(0.1)
        assert ask(port, b"H") == b"H 0.0\r"
