"""The suite on a real pty, over TCP and over RFC 2217: a few short cases here, all of them in `.ci/conformance`."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from protocol.conformance.bench.ports import SessionError, open_port
from protocol.conformance.profile.profile import load_profile

SHORT = ("2.2/1", "3.1/5", "5.1/2", "6.2/2:power-on", "6.1/5", "7.3/3:near")
COMMAND = [sys.executable, "-m", "protocol.conformance", "--yes"]

pytestmark = pytest.mark.realtime


class EmulatorProcess:
    """A running emulator, its port and its control channel."""

    def __init__(self, process: "subprocess.Popen[str]", control: Path) -> None:
        assert process.stdout is not None
        self.port = process.stdout.readline().strip()
        self.control = control


@pytest.fixture(params=[("--pty",), ("--tcp", "0"), ("--rfc2217", "0")], ids=["pty", "tcp", "rfc2217"])
def start_emulator(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[EmulatorProcess]:
    control = tmp_path / "control"
    command = [sys.executable, "-m", "emulator", *request.param, "--control", str(control)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
        try:
            yield EmulatorProcess(process, control)
        finally:
            process.terminate()


def test_the_emulator_conforms_in_real_time(start_emulator: EmulatorProcess, tmp_path: Path) -> None:
    cases = [word for case in SHORT for word in ("--case", case)]
    words = [
        "--port",
        start_emulator.port,
        "--control",
        str(start_emulator.control),
        *cases,
        "--out",
        str(tmp_path / "out"),
    ]
    result = subprocess.run([*COMMAND, *words], capture_output=True, text=True, check=False, timeout=120)
    assert result.returncode == 0, result.stdout + result.stderr
    record = json.loads((tmp_path / "out" / "record.json").read_text())
    assert record["begun"]
    assert {case["verdict"] for case in record["cases"]} <= {"pass", "marginal"}


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_ctrl_c_and_a_polite_kill_stop_the_table_and_leave_the_record(
    number: signal.Signals, start_emulator: EmulatorProcess, tmp_path: Path
) -> None:
    words = [
        "--port",
        start_emulator.port,
        "--control",
        str(start_emulator.control),
        "--case",
        "4.2/3",
        "--out",
        str(tmp_path / "out"),
    ]
    with subprocess.Popen([*COMMAND, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        wait_for_motion(start_emulator.control)
        process.send_signal(number)
        _, said = process.communicate(timeout=60)
    assert process.returncode == 128 + number
    assert "interrupted after 0 of 1 cases; the table was stopped" in said
    state = state_of(start_emulator.control)
    assert state["state"] == "idle"
    assert 1.0 < float(str(state["encoder_deg"])) < 369.0  # where it was, neither at home nor at its target
    assert (tmp_path / "out" / "record.json").exists()


def test_a_polite_kill_of_pytest_stops_the_table_too(start_emulator: EmulatorProcess, tmp_path: Path) -> None:
    plugin = ["-p", "no:cacheprovider", "-p", "seventh_axis.pytest_plugin"]
    table = ["--table-port", start_emulator.port, "--table-control", str(start_emulator.control), "--table-yes"]
    command = [sys.executable, "-m", "pytest", *plugin, "--pyargs", "protocol.conformance", *table, "-k", "4.2/3"]
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).parents[3])}
    with subprocess.Popen(command, cwd=tmp_path, env=environment, stdout=subprocess.PIPE) as process:
        wait_for_motion(start_emulator.control)
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=60)
    assert process.returncode == pytest.ExitCode.INTERRUPTED
    state = state_of(start_emulator.control)
    assert state["state"] == "idle"
    assert 1.0 < float(str(state["encoder_deg"])) < 369.0


def test_two_runs_do_not_share_a_device() -> None:
    ours, theirs = os.openpty()
    try:
        port = open_port(os.ttyname(theirs), load_profile())
        with pytest.raises(SessionError, match=r"cannot open /dev/.*lock"):
            open_port(os.ttyname(theirs), load_profile())
        port.close()
        open_port(os.ttyname(theirs), load_profile()).close()
    finally:
        os.close(ours)
        os.close(theirs)


def wait_for_motion(control: Path) -> None:
    end_s = time.monotonic() + 20
    while time.monotonic() < end_s:
        if control.exists() and float(str(state_of(control)["encoder_deg"])) > 5.0:
            return
        time.sleep(0.1)
    pytest.fail("the table did not move")


def state_of(control: Path) -> dict[str, object]:
    result = subprocess.run(
        [sys.executable, "-m", "emulator.control_client", str(control), "state"],
        capture_output=True,
        text=True,
        check=True,
        timeout=20,
    )
    state: dict[str, object] = json.loads(result.stdout)
    return state
