"""The emulator as its users see it: a process, a port, and third-party clients."""

import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

from emulator import control_client
from tests.emulator.served import Start, WaitUntil, ask, open_port, wait_for_position

pytestmark = [
    pytest.mark.realtime,
    pytest.mark.skipif(sys.platform != "linux", reason="what is known about ptys was measured on Linux"),
]


@pytest.mark.parametrize("kind", ["--pty", "--tcp=0", "--rfc2217=0"])
def test_a_serial_client_drives_the_table_and_preempts_a_motion(
    start_emulator: Start, kind: str, wait_until: WaitUntil
) -> None:
    table = start_emulator(kind, "--time-scale", "10")
    with open_port(table.port) as port:
        assert ask(port, b"H") == b"H 0.0\r"
        assert ask(port, b"S 30") == b"OK\r"
        assert ask(port, b"A 60") == b"OK\r"
        assert ask(port, b"P 90") == b"OK\r"
        wait_until(lambda: 5.0 < float(ask(port, b"H")[2:]) < 85.0)
        assert ask(port, b"P -10") == b"OK\r"
        wait_for_position(port, b"H -10.0\r", wait_until)
        assert ask(port, b"Q") == b"ERR 1 unknown command\r"


def test_a_read_time_out_is_not_negotiated_over_rfc2217(start_emulator: Start, monkeypatch: pytest.MonkeyPatch) -> None:
    table = start_emulator("--rfc2217=0")
    negotiations: list[None] = []
    with open_port(table.port) as port:
        monkeypatch.setattr(port, "_reconfigure_port", lambda: negotiations.append(None))
        for timeout_s in (0.0, None, 5.0):
            port.timeout = timeout_s
            assert port.timeout == timeout_s
        assert ask(port, b"H") == b"H 0.0\r"
    assert not negotiations


def test_both_ports_are_one_wire(start_emulator: Start, wait_until: WaitUntil) -> None:
    table = start_emulator("--pty", "--tcp", "0", "--time-scale", "20")
    url = table.next_line()
    assert table.port.startswith("/dev/")
    assert url.startswith("socket://127.0.0.1:")
    with open_port(table.port) as device:
        assert ask(device, b"P 5") == b"OK\r"
    with open_port(url) as network:
        wait_for_position(network, b"H 5.0\r", wait_until)


def test_bytes_take_their_time_on_the_line(start_emulator: Start) -> None:
    """A round trip of `H` takes 2 + 6 bytes; at 1200 baud no machine can be too slow to see it."""
    table = start_emulator("--pty", "--baud", "1200")
    with open_port(table.port, 1200) as port:
        begin_s = time.monotonic()
        for _ in range(3):
            ask(port, b"H")
        assert time.monotonic() - begin_s > 3 * 8 * 10 / 1200 - 0.01


def test_strict_table_1_and_decimals_reach_the_table(start_emulator: Start) -> None:
    table = start_emulator("--pty", "--baud", "0", "--strict-table1", "--decimals", "3")
    with open_port(table.port) as port:
        port.write(b"Q\r")
        assert ask(port, b"H") == b"H 0.000\r"


@pytest.mark.skipif(not shutil.which("picocom"), reason="picocom is not installed")
def test_picocom_talks_to_the_table(start_emulator: Start) -> None:
    table = start_emulator("--pty")
    command = ["picocom", "-q", "-b", "9600", "-x", "500", table.port]
    done = subprocess.run(command, input=b"H\rS 5\rX\r", capture_output=True, timeout=20, check=False)
    assert done.stdout == b"H 0.0\rOK\rERR 1 unknown command\r"


@pytest.mark.skipif(not shutil.which("socat"), reason="socat is not installed")
@pytest.mark.parametrize("line_end", [b"\r", b"\r\n"])
def test_socat_talks_to_the_table(start_emulator: Start, line_end: bytes) -> None:
    table = start_emulator("--pty")
    command = ["socat", "-t", "0.5", "-", f"{table.port},raw,echo=0,b9600"]
    done = subprocess.run(
        command, input=b"H" + line_end + b"L" + line_end, capture_output=True, timeout=20, check=False
    )
    assert done.stdout == b"H 0.0\rL 0.0\r"


def test_the_shell_is_client_enough(start_emulator: Start, tmp_path: Path, wait_until: WaitUntil) -> None:
    """It opens, writes and closes before the line has transmitted its bytes: they arrive nevertheless."""
    control = tmp_path / "control"
    table = start_emulator("--pty", "--time-scale", "20", "--control", str(control))
    subprocess.run(["sh", "-c", f"{{ printf 'S 40\\r'; printf 'P 20\\r'; }} > {table.port}"], check=True)
    wait_until(lambda: control_client.request(control, "state")["reference_deg"] > 0.0)
    with open_port(table.port) as port:
        wait_for_position(port, b"H 20.0\r", wait_until)
