"""Programs that move a table, ended by a signal on a real pty; and programs interrupted during their start."""

import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import pytest

from emulator.control_client import request
from tests.planner.run_examples import write_short_scan
from tests.planner.small_scan import SMALL

OURS = re.compile(rf"{re.escape(str(Path(__file__).parents[2]))}/(emulator|planner|protocol|tools)/")
"""A file of this project in a traceback."""
SLOWLY = 0.3
"""The time scale of the emulator for a scan that would otherwise end too early."""
STANDS = re.compile(r"the table was stopped and stands at (-?[0-9.]+) deg")


class EmulatorProcess(NamedTuple):
    """An emulator on a pty, and its control channel."""

    port: str
    control: Path

    @property
    def speed_deg_s(self) -> float:
        return float(request(self.control, "state")["reference_speed_deg_s"])

    def wait_until(self, is_moving: bool, timeout_s: float = 180.0) -> None:
        end_s = time.monotonic() + timeout_s
        while (abs(self.speed_deg_s) > 1.0) != is_moving:
            assert time.monotonic() < end_s, "the table did not begin to move" if is_moving else "the table moves on"
            time.sleep(0.01)


@contextmanager
def start_emulator(folder: Path, time_scale: float = 1.0) -> Iterator[EmulatorProcess]:
    control = folder / "control"
    command = [sys.executable, "-m", "emulator", "--pty", "--control", str(control), "--time-scale", f"{time_scale}"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
        assert process.stdout is not None
        try:
            yield EmulatorProcess(process.stdout.readline().strip(), control)
        finally:
            process.terminate()


def run_command(table: EmulatorProcess, folder: Path) -> list[str]:
    """Return `planner run` of a short plan, from a table that stands elsewhere."""
    words = ["planner", "run", str(write_short_scan(folder)), "--port", table.port, "--control", str(table.control)]
    return [*words, "--time-scale", f"{SLOWLY}", "--arm-away", "--out", str(folder / "out")]


def scan_command(table: EmulatorProcess, folder: Path) -> list[str]:
    file = folder / "part.toml"
    file.write_text(SMALL)
    words = ["planner", "scan", str(file), "--port", table.port, "--control", str(table.control), "--rate", "5"]
    quickly = ["--angles", "60", "--configuration", "LEFTY-ABOVE-NOFLIP", "--exact-calibration"]
    return [*words, *quickly, "--time-scale", f"{SLOWLY}", "--out", str(folder / "out")]


def record_command(table: EmulatorProcess, folder: Path) -> list[str]:
    return ["tools.identify", "record", "--port", table.port, "--out", str(folder / "trace.csv")]


COMMANDS = {"run": (run_command, SLOWLY), "scan": (scan_command, SLOWLY), "record": (record_command, 1.0)}


@pytest.mark.realtime
@pytest.mark.parametrize("numbers", [
    (signal.SIGINT,),
    (signal.SIGTERM,),
    (signal.SIGHUP,),
    (signal.SIGINT, signal.SIGINT),
    (signal.SIGHUP, signal.SIGTERM),
], ids=lambda numbers: "+".join(number.name for number in numbers))  # fmt: skip
@pytest.mark.parametrize("name", COMMANDS)
def test_a_signal_stops_the_table_and_a_second_one_does_not_cut_that_short(
    name: str, numbers: Sequence[signal.Signals], tmp_path: Path
) -> None:
    command, time_scale = COMMANDS[name]
    with start_emulator(tmp_path, time_scale) as table:
        words = [sys.executable, "-m", *command(table, tmp_path)]
        with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
            table.wait_until(is_moving=True)
            for number in numbers:
                process.send_signal(number)
                time.sleep(0.02)
            out, err = process.communicate(timeout=60)
        state = request(table.control, "state")
    assert process.returncode == 128 + numbers[0], err
    assert "Traceback" not in err
    assert state["state"] == "idle"
    said = STANDS.search(out + err)
    assert said is not None, out + err
    assert float(said[1]) == pytest.approx(float(state["encoder_deg"]), abs=0.06)


@pytest.mark.realtime
def test_an_ignored_ctrl_c_stays_ignored(tmp_path: Path) -> None:
    with start_emulator(tmp_path, 1.0) as table:
        script = f"trap '' INT; exec {sys.executable} -m {' '.join(record_command(table, tmp_path))} --duration 10"
        with subprocess.Popen(["/bin/sh", "-c", script], stderr=subprocess.PIPE, text=True) as process:
            table.wait_until(is_moving=True)
            process.send_signal(signal.SIGINT)
            time.sleep(0.5)
            assert process.poll() is None
            process.send_signal(signal.SIGTERM)
            process.communicate(timeout=60)
        assert process.returncode == 128 + signal.SIGTERM


@pytest.mark.realtime
@pytest.mark.parametrize("program", [
    ["planner", "plan", "cylinder", "--out", "out"],
    ["tools.tune", "--out", "out"],
    ["tools.bench", "map"],
    ["protocol.conformance", "--port", "emulator://", "--out", "out"],
    ["emulator", "--pty"],
], ids=lambda words: words[0])  # fmt: skip
def test_ctrl_c_as_a_program_starts_is_one_line_and_status_130(program: Sequence[str], tmp_path: Path) -> None:
    ended = 0
    for wait_s in (0.06, 0.1, 0.15, 0.25, 0.4):
        words = [sys.executable, "-m", *program]
        with subprocess.Popen(
            words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=tmp_path
        ) as process:
            time.sleep(wait_s)
            process.send_signal(signal.SIGINT)
            _, err = process.communicate(timeout=60)
        if process.returncode in {-signal.SIGINT, 1} and not OURS.search(err):
            continue  # on a busy machine Python itself was still starting
        assert process.returncode in {0, 130}, (wait_s, err)
        ended += process.returncode == 130
        assert "Traceback" not in err, (wait_s, err)
    assert ended
