"""The process with the compiled firmware: `python -m emulator --firmware avr`."""

import signal
import subprocess
import sys
from pathlib import Path

import pytest

from emulator import control_client
from emulator.__main__ import main
from emulator.trace import read_trace
from tests.emulator.avr.toolchain_mark import needs_toolchain
from tests.emulator.served import Start, WaitUntil, ask, open_port, wait_for_position


@needs_toolchain
@pytest.mark.realtime
@pytest.mark.skipif(sys.platform != "linux", reason="what is known about ptys was measured on Linux")
def test_the_compiled_firmware_is_a_table_on_a_pty_with_trace_trigger_and_control(
    start_emulator: Start, wait_until: WaitUntil, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    control, trace = tmp_path / "control", tmp_path / "run.csv"
    options = ("--pty", "--firmware", "avr", "--time-scale", "4", "--control", str(control), "--trace", str(trace))
    table = start_emulator(*options)
    with open_port(table.port) as port:
        assert ask(port, b"P 2") == b"OK\r"
        wait_for_position(port, b"H 2.0\r", wait_until)
        table.process.send_signal(signal.SIGUSR1)
        wait_until(lambda: ask(port, b"L") == b"L 2.0\r")
    assert control_client.main([str(control), "fault-stall"]) != 0
    assert "stall has no effect on the compiled firmware" in capsys.readouterr().err
    table.process.send_signal(signal.SIGTERM)
    assert table.process.wait(20) == 0
    recorded = read_trace(trace)
    assert recorded.encoder_deg[-1] == pytest.approx(2, abs=0.05)
    assert b"".join(recorded.received).startswith(b"P 2\r")


@needs_toolchain
@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--firmware", "none.elf"], "--firmware none.elf: none.elf: No such file or directory; name the .elf file"),
        (["--firmware", __file__], "is not this firmware"),
        (["--firmware", "avr", "--baud", "0"], "serial.baud is 0"),
    ],
)
def test_a_firmware_that_cannot_be_run_is_one_line_and_status_2(
    options: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["--tcp", "0", *options]) == 2
    refusal = capsys.readouterr().err
    assert words in refusal
    assert refusal.count("\n") == 1


def test_without_the_option_nothing_of_it_is_imported() -> None:
    program = "import sys, emulator.__main__; print('ctypes' in sys.modules, 'emulator.avr.chip' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "False"]
