"""The process: signals, the control channel, its end, and starts that must fail."""

import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

from emulator import control_client
from emulator.trace import read_trace
from tests.emulator.served import EmulatorProcess, Start, WaitUntil, ask, open_port, wait_for_position

pytestmark = [
    pytest.mark.realtime,
    pytest.mark.skipif(sys.platform != "linux", reason="what is known about ptys was measured on Linux"),
]


def refusal(*arguments: str) -> str:
    """Return the one line on stderr of a start that must fail."""
    done = subprocess.run(
        [sys.executable, "-m", "emulator", *arguments], capture_output=True, text=True, timeout=20, check=False
    )
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.count("\n") == 1, done.stderr
    return done.stderr


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
def test_a_signal_ends_it_well_and_leaves_nothing_behind(
    start_emulator: Start, tmp_path: Path, number: signal.Signals
) -> None:
    if signal.getsignal(number) is signal.SIG_IGN:
        pytest.skip(f"{number.name} is ignored here, as under nohup")
    link, control, trace = tmp_path / "table", tmp_path / "control", tmp_path / "run.csv"
    table = start_emulator("--pty", "--link", str(link), "--control", str(control), "--trace", str(trace))
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


def test_sigusr1_is_the_probes_trigger(start_emulator: Start, wait_until: WaitUntil) -> None:
    table = start_emulator("--pty", "--time-scale", "20", "--baud", "0")
    with open_port(table.port) as port:
        ask(port, b"P 7")
        wait_for_position(port, b"H 7.0\r", wait_until)
        assert ask(port, b"L") == b"L 0.0\r"
        table.process.send_signal(signal.SIGUSR1)
        wait_until(lambda: ask(port, b"L") == b"L 7.0\r")


def test_a_periodic_trigger_latches_by_itself(start_emulator: Start, wait_until: WaitUntil) -> None:
    table = start_emulator("--pty", "--time-scale", "20", "--trigger-hz", "50")
    with open_port(table.port) as port:
        ask(port, b"P 3")
        wait_until(lambda: ask(port, b"L") == b"L 3.0\r")


def test_the_control_channel_acts_on_the_running_table(
    start_emulator: Start, tmp_path: Path, wait_until: WaitUntil
) -> None:
    control = tmp_path / "control"
    table = start_emulator("--pty", "--control", str(control), "--time-scale", "20", "--baud", "0")
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


def test_a_time_scale_beyond_the_machine_is_said_once_and_clients_are_still_answered(start_emulator: Start) -> None:
    table = start_emulator("--pty", "--time-scale", "1e6", "--baud", "0")
    with open_port(table.port) as port:
        ask(port, b"S 0.1")
        ask(port, b"P 10000")
        table.wait_for_words("simulated time falls behind")
        assert ask(port, b"H").startswith(b"H ")
        time.sleep(0.3)
    assert table.stderr.count("falls behind") == 1


def test_at_rest_it_uses_nearly_no_time(start_emulator: Start) -> None:
    table = start_emulator("--pty", "--trigger-hz", "0")
    stat = Path(f"/proc/{table.process.pid}/stat")

    def used_s() -> float:
        fields = stat.read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    before_s = used_s()
    time.sleep(1.0)
    # Far above the normal value (0.01) and far below that of a busy loop (1.0).
    assert used_s() - before_s < 0.3


def test_a_script_that_reads_one_line_and_no_more_does_not_stop_it() -> None:
    command = [sys.executable, "-m", "emulator", "--pty"]
    buffered = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=buffered)
    assert process.stdout is not None
    name = process.stdout.readline().strip()
    process.stdout.close()
    with open_port(name, 4800) as port:  # a reason to refuse all connections
        port.write(b"H\r")
        port.baudrate = 9600
        time.sleep(0.1)
        assert ask(port, b"\rH").endswith(b"\r")
    process.terminate()
    assert process.wait(10) == 0


def test_a_trace_for_which_there_is_no_room_is_said_and_what_was_written_stays(tmp_path: Path) -> None:
    arguments = ["--pty", "--trace", str(tmp_path / "run.csv"), "--link", str(tmp_path / "table")]
    limited = f"ulimit -f 1; exec {sys.executable} -m emulator {' '.join(arguments)}"
    process = subprocess.Popen(["sh", "-c", limited], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout is not None
    with open_port(process.stdout.readline().strip()) as port:
        ask(port, b"P 10")
        _, stderr = process.communicate(timeout=10)  # the limit ends it
    assert process.returncode == 2
    assert stderr.splitlines()[-1].endswith(f"the rows written so far are in {tmp_path / 'run.csv.part'}, as CSV")
    assert [path.name for path in tmp_path.iterdir()] == ["run.csv.part"]
    assert len((tmp_path / "run.csv.part").read_bytes()) in {512, 1024}  # the unit of `ulimit -f`


def test_a_second_emulator_with_the_same_files_is_refused_and_the_first_goes_on(
    start_emulator: Start, tmp_path: Path
) -> None:
    link, trace = tmp_path / "table", tmp_path / "run.csv"
    table = start_emulator("--pty", "--link", str(link), "--trace", str(trace))
    assert "another emulator" in refusal("--pty", "--link", str(link))
    assert "another emulator" in refusal("--pty", "--trace", str(trace))
    with open_port(str(link)) as port:
        assert ask(port, b"H") == b"H 0.0\r"
    table.process.terminate()
    table.process.wait(10)
    assert b"".join(read_trace(trace).received) == b"H\r"


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
        ([], "--pty, --tcp, --rfc2217"),
        (["--link", "x", "--tcp", "0"], "--pty"),
        (["--pty", "--baud", "-1"], "baud"),
        (["--pty", "--baud", "fast"], "--baud"),
        (["--pty", "--time-scale", "0"], "--time-scale"),
        (["--pty", "--time-scale", "nan"], "--time-scale"),
        (["--pty", "--time-scale", "inf"], "--time-scale"),
        (["--pty", "--trigger-hz", "1e9"], "--trigger-hz"),
        *(
            (["--pty", "--trigger-hz", text], f"--trigger-hz: {text!r} is not a number from 0")
            for text in ("inf", "nan", "-1", "x")
        ),
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
        (["--pty", "--seed", "9" * 5000], "--seed"),
        (["--pty", "--baud", "9" * 4000], "baud"),
        (["--pty", "--time-scale", "1e306"], "--time-scale"),
        (["--pty", "--time-scale", "1e-9"], "--time-scale"),
        (["--tcp", "9" * 5000], "--tcp"),
        (["--rfc2217", "70000"], "--rfc2217"),
        (["--pty", "--config", "/dev/zero"], "/dev/zero"),
    ],
)
def test_what_cannot_be_used_is_one_line_and_status_2(arguments: list[str], words: str) -> None:
    assert words in refusal(*arguments)


def test_help_shows_an_example() -> None:
    done = subprocess.run([sys.executable, "-m", "emulator", "--help"], capture_output=True, text=True, check=True)
    assert "example:" in done.stdout


def stopped_for(table: EmulatorProcess, duration_s: float) -> float:
    """Stop the process with SIGSTOP, continue it, and return the minimum duration of the stop, in seconds."""
    state = Path(f"/proc/{table.process.pid}/stat")
    table.process.send_signal(signal.SIGSTOP)
    while state.read_text().rpartition(")")[2].split()[0] != "T":
        time.sleep(0.001)
    begin_s = time.monotonic()
    time.sleep(duration_s)
    end_s = time.monotonic()
    table.process.send_signal(signal.SIGCONT)
    return end_s - begin_s


@pytest.mark.parametrize("command", [b"H", b"P 100"], ids=["at rest", "in motion"])
def test_a_long_stop_of_the_process_is_left_out_at_rest_and_in_motion(
    start_emulator: Start, tmp_path: Path, command: bytes
) -> None:
    control = tmp_path / "control"
    table = start_emulator("--pty", "--control", str(control))
    with open_port(table.port) as port:
        assert ask(port, b"S 2") == b"OK\r"
        ask(port, command)
        time.sleep(0.5)
        before_s, before = time.monotonic(), control_client.request(control, "state")
        stood_s = stopped_for(table, 0.8)
        table.wait_for_words("simulated time falls behind")
        time.sleep(0.1)  # time to catch up if the clock were ahead
        after, after_s = control_client.request(control, "state"), time.monotonic()
    passed_s = (after["tick"] - before["tick"]) / 1000
    assert passed_s <= after_s - before_s - stood_s + 0.001  # not even half a second is caught up
    speed_deg_s = 2.0 if command == b"P 100" else 0.0
    assert after["reference_deg"] - before["reference_deg"] == pytest.approx(speed_deg_s * passed_s, abs=1e-3)


def test_a_short_stop_of_the_process_is_made_up_for(start_emulator: Start, tmp_path: Path) -> None:
    control = tmp_path / "control"
    table = start_emulator("--pty", "--control", str(control))
    before, before_s = control_client.request(control, "state"), time.monotonic()
    stopped_for(table, 0.2)
    after_s, after = time.monotonic(), control_client.request(control, "state")
    # A busy machine may have stopped it for longer.
    assert (after["tick"] - before["tick"]) / 1000 >= after_s - before_s - 0.001 or "falls behind" in table.stderr
