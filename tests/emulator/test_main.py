"""The stand-in as its users meet it: a process, a port, and clients that nobody here wrote."""

import os
import random
import select
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Protocol

import pytest
import serial

from emulator import control_client
from emulator.trace import read_trace

pytestmark = [
    pytest.mark.realtime,
    pytest.mark.skipif(sys.platform != "linux", reason="what is known about ptys was measured on Linux"),
]

WaitUntil = Callable[[Callable[[], bool]], None]


class StandIn(Protocol):
    """What the fixture `stand_in` starts."""

    process: subprocess.Popen[str]
    port: str

    @property
    def stderr(self) -> str: ...
    def next_line(self) -> str: ...
    def wait_for_words(self, words: str) -> None: ...


Start = Callable[..., StandIn]


def open_port(url: str, baud: int = 9600) -> serial.Serial:
    return serial.serial_for_url(url, baudrate=baud, timeout=10.0, write_timeout=10.0)


def ask(port: serial.Serial, command: bytes) -> bytes:
    port.write(command + b"\r")
    return bytes(port.read_until(b"\r"))


def wait_for_position(port: serial.Serial, reply: bytes, wait_until: WaitUntil) -> None:
    wait_until(lambda: ask(port, b"H") == reply)


def refusal(*arguments: str) -> str:
    """Return the one line that a start which must fail leaves on stderr."""
    done = subprocess.run(
        [sys.executable, "-m", "emulator", *arguments], capture_output=True, text=True, timeout=20, check=False
    )
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.count("\n") == 1, done.stderr
    return done.stderr


# The main job


@pytest.mark.parametrize("kind", ["--pty", "--tcp=0"])
def test_a_serial_client_drives_the_table_and_preempts_a_motion(
    stand_in: Start, kind: str, wait_until: WaitUntil
) -> None:
    table = stand_in(kind, "--time-scale", "10")
    with open_port(table.port) as port:
        assert ask(port, b"H") == b"H 0.0\r"
        assert ask(port, b"S 30") == b"OK\r"
        assert ask(port, b"A 60") == b"OK\r"
        assert ask(port, b"P 90") == b"OK\r"
        wait_until(lambda: 5.0 < float(ask(port, b"H")[2:]) < 85.0)
        assert ask(port, b"P -10") == b"OK\r"
        wait_for_position(port, b"H -10.0\r", wait_until)
        assert ask(port, b"Q") == b"ERR 1 unknown command\r"


def test_both_ports_are_one_wire(stand_in: Start, wait_until: WaitUntil) -> None:
    table = stand_in("--pty", "--tcp", "0", "--time-scale", "20")
    url = table.next_line()
    assert table.port.startswith("/dev/")
    assert url.startswith("socket://127.0.0.1:")
    with open_port(table.port) as device:
        assert ask(device, b"P 5") == b"OK\r"
    with open_port(url) as network:
        wait_for_position(network, b"H 5.0\r", wait_until)


def test_bytes_take_their_time_on_the_line(stand_in: Start) -> None:
    """A round trip of `H` takes 2 + 6 bytes; at 1200 baud no machine can be too slow to see it."""
    table = stand_in("--pty", "--baud", "1200")
    with open_port(table.port, 1200) as port:
        begin_s = time.monotonic()
        for _ in range(3):
            ask(port, b"H")
        assert time.monotonic() - begin_s > 3 * 8 * 10 / 1200 - 0.01


def test_strict_table_1_and_decimals_reach_the_table(stand_in: Start) -> None:
    table = stand_in("--pty", "--baud", "0", "--strict-table1", "--decimals", "3")
    with open_port(table.port) as port:
        port.write(b"Q\r")
        assert ask(port, b"H") == b"H 0.000\r"


# Clients that nobody here wrote


@pytest.mark.skipif(not shutil.which("picocom"), reason="picocom is not installed")
def test_picocom_talks_to_the_table(stand_in: Start) -> None:
    table = stand_in("--pty")
    command = ["picocom", "-q", "-b", "9600", "-x", "500", table.port]
    done = subprocess.run(command, input=b"H\rS 5\rX\r", capture_output=True, timeout=20, check=False)
    assert done.stdout == b"H 0.0\rOK\rERR 1 unknown command\r"


@pytest.mark.skipif(not shutil.which("socat"), reason="socat is not installed")
@pytest.mark.parametrize("line_end", [b"\r", b"\r\n"])
def test_socat_talks_to_the_table(stand_in: Start, line_end: bytes) -> None:
    table = stand_in("--pty")
    command = ["socat", "-t", "0.5", "-", f"{table.port},raw,echo=0,b9600"]
    done = subprocess.run(
        command, input=b"H" + line_end + b"L" + line_end, capture_output=True, timeout=20, check=False
    )
    assert done.stdout == b"H 0.0\rL 0.0\r"


def test_the_shell_is_client_enough(stand_in: Start, wait_until: WaitUntil) -> None:
    """Each printf opens, writes and goes before the line has carried its bytes: they arrive all the same."""
    table = stand_in("--pty", "--time-scale", "20")
    subprocess.run(["sh", "-c", f"printf 'S 40\\r' > {table.port}; printf 'P 20\\r' > {table.port}"], check=True)
    with open_port(table.port) as port:
        wait_for_position(port, b"H 20.0\r", wait_until)


# Clients that misbehave


def test_a_half_line_is_not_glued_to_the_next_clients_first(stand_in: Start) -> None:
    table = stand_in("--pty")
    half = os.open(table.port, os.O_RDWR | os.O_NOCTTY)
    os.write(half, b"P 9")
    os.close(half)
    time.sleep(0.1)
    after = os.open(table.port, os.O_RDWR | os.O_NOCTTY)
    os.write(after, b"0\r")
    reply = b""
    while not reply.endswith(b"\r"):  # what is on the wire when a client leaves may reach the next one
        assert select.select([after], [], [], 10.0)[0]
        reply += os.read(after, 64)
    os.close(after)
    assert reply == b"ERR 1 unknown command\r"
    with open_port(table.port) as port:
        assert ask(port, b"H") == b"H 0.0\r"
        time.sleep(0.2)
        assert ask(port, b"H") == b"H 0.0\r"


def test_a_client_may_come_and_go_many_times(stand_in: Start) -> None:
    table = stand_in("--pty", "--baud", "0")
    for _ in range(50):
        with open_port(table.port) as port:
            assert ask(port, b"H") == b"H 0.0\r"
    assert "two programs" not in table.stderr


def test_random_bytes_by_the_megabyte_move_nothing(stand_in: Start, tmp_path: Path, wait_until: WaitUntil) -> None:
    """Any bytes at any split: one reply a line, in order, and the motion that was running goes on untouched."""
    control = tmp_path / "control"
    table = stand_in("--pty", "--baud", "0", "--time-scale", "0.01", "--control", str(control))
    chance = random.Random(1)  # noqa: S311  # noise is no secret
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


def test_an_unread_client_blocks_neither_commands_nor_others(stand_in: Start, wait_until: WaitUntil) -> None:
    table = stand_in("--pty", "--baud", "0", "--tcp", "0", "--time-scale", "20")
    url = table.next_line()
    deaf = os.open(table.port, os.O_RDWR | os.O_NOCTTY)
    os.write(deaf, b"P 10\r")
    for _ in range(20):
        os.write(deaf, b"Q\r" * 500)
    table.wait_for_words("does not read its replies")
    with open_port(url) as port:
        port.timeout = 0.5
        port.read(1 << 20)  # The replies to the other are heard here too, as long as there are any.
        wait_until(lambda: ask(port, b"H") == b"H 10.0\r")
    assert "at once" in table.stderr
    os.close(deaf)


def test_a_client_that_floods_a_slow_line_is_made_to_wait_and_the_next_one_is_not_confused(stand_in: Start) -> None:
    table = stand_in("--pty", "--time-scale", "20")
    with open_port(table.port) as port:
        port.write_timeout = 0.2
        with pytest.raises(serial.SerialTimeoutException):
            port.write(b"L\r" * 100_000)
    time.sleep(0.1)
    with open_port(table.port) as port:
        assert ask(port, b"H") == b"H 0.0\r"


def test_a_wrong_rate_is_garbage_and_stderr_says_why(stand_in: Start) -> None:
    table = stand_in("--pty")
    with open_port(table.port, 4800) as port:
        port.write(b"P 90\r")
        table.wait_for_words("set to 4800 baud and the table to 9600")
        time.sleep(0.2)
    with open_port(table.port) as port:
        assert ask(port, b"H") == b"H 0.0\r"


def test_a_client_that_is_killed_in_mid_line_leaves_a_working_table(stand_in: Start) -> None:
    table = stand_in("--pty")
    script = f"exec 3<>{table.port}; printf 'P 1' >&3; echo; read never_comes <&3"
    with subprocess.Popen(["sh", "-c", script], stdout=subprocess.PIPE) as client:
        assert client.stdout is not None
        client.stdout.readline()
        client.kill()
    with open_port(table.port) as port:
        time.sleep(0.1)
        assert ask(port, b"H") == b"H 0.0\r"


# Signals, the link, and the end


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
def test_a_signal_ends_it_well_and_leaves_nothing_behind(
    stand_in: Start, tmp_path: Path, number: signal.Signals
) -> None:
    if signal.getsignal(number) is signal.SIG_IGN:
        pytest.skip(f"{number.name} is ignored here, as under nohup")
    link, control, trace = tmp_path / "table", tmp_path / "control", tmp_path / "run.csv"
    table = stand_in("--pty", "--link", str(link), "--control", str(control), "--trace", str(trace))
    with open_port(str(link)) as port:
        assert ask(port, b"P 1") == b"OK\r"
        table.process.send_signal(number)
        assert table.process.wait(10) == 0
    assert not link.is_symlink()
    assert not control.exists()
    recorded = read_trace(trace)
    assert b"".join(recorded.received) == b"P 1\r"
    assert b"".join(recorded.transmitted) == b"OK\r"


@pytest.mark.skipif(shutil.which("nohup") is None, reason="nohup is not installed")
def test_a_table_that_nohup_started_outlives_its_terminal() -> None:
    command = ["nohup", sys.executable, "-m", "emulator", "--tcp", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as table:
        assert table.stdout is not None
        with open_port(table.stdout.readline().strip()) as port:
            table.send_signal(signal.SIGHUP)
            assert ask(port, b"H") == b"H 0.0\r"
            table.terminate()
        assert table.wait(10) == 0


def test_sigusr1_is_the_probes_trigger(stand_in: Start, wait_until: WaitUntil) -> None:
    table = stand_in("--pty", "--time-scale", "20", "--baud", "0")
    with open_port(table.port) as port:
        ask(port, b"P 7")
        wait_for_position(port, b"H 7.0\r", wait_until)
        assert ask(port, b"L") == b"L 0.0\r"
        table.process.send_signal(signal.SIGUSR1)
        wait_until(lambda: ask(port, b"L") == b"L 7.0\r")


def test_a_periodic_trigger_latches_by_itself(stand_in: Start, wait_until: WaitUntil) -> None:
    table = stand_in("--pty", "--time-scale", "20", "--trigger-hz", "50")
    with open_port(table.port) as port:
        ask(port, b"P 3")
        wait_until(lambda: ask(port, b"L") == b"L 3.0\r")


def test_the_control_channel_acts_on_the_running_table(stand_in: Start, tmp_path: Path, wait_until: WaitUntil) -> None:
    control = tmp_path / "control"
    table = stand_in("--pty", "--control", str(control), "--time-scale", "20", "--baud", "0")
    with open_port(table.port) as port:
        ask(port, b"P 12")
        wait_for_position(port, b"H 12.0\r", wait_until)
        control_client.request(control, "trigger")
        assert ask(port, b"L") == b"L 12.0\r"
        state = control_client.request(control, "state")
        assert state["time_scale"] == 20.0
        assert state["latched_deg"] == pytest.approx(12.0, abs=0.05)
        control_client.request(control, "load-torque", torque_Nm=0.5)
        assert control_client.request(control, "state")["load_torque_Nm"] == 0.5
        control_client.request(control, "reset")
        assert ask(port, b"H") == b"H 0.0\r"
    control_client.request(control, "quit")
    assert table.process.wait(10) == 0
    assert not control.exists()


def test_a_time_scale_beyond_the_machine_is_said_once_and_clients_are_still_answered(stand_in: Start) -> None:
    table = stand_in("--pty", "--time-scale", "1e6", "--baud", "0")
    with open_port(table.port) as port:
        ask(port, b"S 0.1")
        ask(port, b"P 10000")
        table.wait_for_words("simulated time falls behind")
        assert ask(port, b"H").startswith(b"H ")
        time.sleep(0.3)
    assert table.stderr.count("falls behind") == 1


def test_at_rest_it_uses_nearly_no_time(stand_in: Start) -> None:
    table = stand_in("--pty", "--trigger-hz", "0")
    stat = Path(f"/proc/{table.process.pid}/stat")

    def used_s() -> float:
        fields = stat.read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    before_s = used_s()
    time.sleep(1.0)
    # Well above what it takes (0.01) and well below what a loop that spins takes (1.0).
    assert used_s() - before_s < 0.3


def test_a_script_that_reads_one_line_and_no_more_does_not_stop_it() -> None:
    command = [sys.executable, "-m", "emulator", "--pty"]
    buffered = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=buffered)
    assert process.stdout is not None
    name = process.stdout.readline().strip()
    process.stdout.close()
    with open_port(name, 4800) as port:  # a reason to speak to nobody
        port.write(b"H\r")
        port.baudrate = 9600
        time.sleep(0.1)
        assert ask(port, b"\rH").endswith(b"\r")
    process.terminate()
    assert process.wait(10) == 0


def test_a_trace_for_which_there_is_no_room_is_said_and_leaves_no_half_file(tmp_path: Path) -> None:
    (tmp_path / "run.csv.part").symlink_to("/dev/full")
    process = subprocess.Popen(
        [
            sys.executable,
            "-m",
            "emulator",
            "--pty",
            "--trace",
            str(tmp_path / "run.csv"),
            "--link",
            str(tmp_path / "table"),
        ],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    process.stdout.readline()
    process.terminate()
    _, stderr = process.communicate(timeout=10)
    assert process.returncode == 2
    assert "No space left" in stderr.splitlines()[-1]
    assert [path.name for path in tmp_path.iterdir()] == ["run.csv.part"]


# Starts that must fail


def test_a_link_path_that_is_an_ordinary_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "thesis.tex"
    path.write_text("three years of work")
    assert str(path) in refusal("--pty", "--link", str(path))
    assert path.read_text() == "three years of work"


def test_a_port_that_is_taken_is_refused() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        number = taken.getsockname()[1]
        assert str(number) in refusal("--tcp", str(number))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([], "--pty, --tcp"),
        (["--link", "x", "--tcp", "0"], "--pty"),
        (["--pty", "--baud", "-1"], "baud"),
        (["--pty", "--baud", "fast"], "--baud"),
        (["--pty", "--time-scale", "0"], "--time-scale"),
        (["--pty", "--time-scale", "nan"], "--time-scale"),
        (["--pty", "--trigger-hz", "1e9"], "--trigger-hz"),
        (["--pty", "--decimals", "99"], "decimals"),
        (["--tcp", "70000"], "--tcp"),
        (["--tcp", "192.0.2.1:7000"], "192.0.2.1"),
        (["--tcp", "no.such.host.invalid:7000"], "no.such.host"),
        (["--pty", "--config", "/no/such/file.toml"], "/no/such/file.toml"),
        (["--pty", "--trace", "run.txt"], ".csv or .npz"),
        (["--pty", "--trace", "/no/such/folder/run.csv"], "--trace"),
        (["--pty", "--control", "/no/such/folder/socket"], "--control"),
        (["--pty", "--control", "x" * 200], "--control"),
        (["--pty", "--sed", "1"], "--sed"),
        (["--pty", "--seed", "-1"], "--seed"),
    ],
)
def test_what_cannot_be_used_is_one_line_and_status_2(arguments: list[str], words: str) -> None:
    assert words in refusal(*arguments)


def test_help_shows_an_example() -> None:
    done = subprocess.run([sys.executable, "-m", "emulator", "--help"], capture_output=True, text=True, check=True)
    assert "example:" in done.stdout
