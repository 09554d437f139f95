"""The pyserial port `compiled://`: the compiled firmware behind the client and the conformance kit."""

from pathlib import Path

import pytest
import serial

import emulator  # noqa: F401  # registers the URL with pyserial
from emulator.avr.toolchain import FIRMWARE
from protocol import TableClient
from protocol.conformance.__main__ import main as conformance
from tests.emulator.avr.toolchain_mark import needs_toolchain

PROFILE = str(FIRMWARE.with_name("profile.toml"))
CASES = [f"--case={clause}" for clause in ("3.2", "4.5/4", "5.2", "7.1/1$")]


@needs_toolchain
def test_a_client_moves_the_table_of_the_compiled_firmware() -> None:
    with TableClient.open("compiled://?seed=3&decimals=3") as table:
        table.set_speed(30)
        table.move_to(20)
        assert table.wait_until_at(20) == pytest.approx(20, abs=0.005)
        table.move_by(10)
        stands_deg = table.stop()
    assert 20 <= stands_deg <= 30


@needs_toolchain
def test_strict_table_1_is_built_into_the_firmware() -> None:
    with serial.serial_for_url("compiled://?strict=1", timeout=0.1) as port:
        port.write(b"Q\rH\r")
        assert port.read_until(b"\r") == b"H 0.0\r"


@pytest.mark.parametrize(
    ("url", "words"),
    [
        ("compiled://?colour=red", "is not compiled://[?config=PATH&firmware=ELF&seed=N"),
        ("compiled://host", "is not compiled://"),
        ("compiled://?baud=0", "serial.baud is 0"),
        ("compiled://?firmware=/none.elf", "/none.elf: No such file or directory; name the .elf file"),
        ("compiled://?seed=x", "the form is compiled://"),
    ],
)
@needs_toolchain
def test_a_url_that_cannot_be_used_is_refused(url: str, words: str) -> None:
    with pytest.raises(serial.SerialException) as refusal:
        serial.serial_for_url(url)
    assert words in str(refusal.value)


@needs_toolchain
def test_cases_pass_twice_with_the_same_record(tmp_path: Path) -> None:
    for run in ("first", "second"):
        assert conformance(["--port=compiled://", "--profile", PROFILE, *CASES, f"--out={tmp_path / run}"]) == 0
    assert (tmp_path / "first/record.json").read_bytes() == (tmp_path / "second/record.json").read_bytes()


@needs_toolchain
@pytest.mark.parametrize(("recorded", "replayed"), [("compiled://", "emulator://"), ("emulator://", "compiled://")])
def test_a_record_of_one_is_answered_alike_by_the_other(
    recorded: str, replayed: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert conformance([f"--port={recorded}", "--profile", PROFILE, *CASES, f"--out={tmp_path}"]) == 0
    record = str(tmp_path / "record.json")
    assert conformance([f"--port={replayed}", "--profile", PROFILE, *CASES, f"--replay={record}"]) == 0
    assert ", 0 differ" in capsys.readouterr().out
