from pathlib import Path

import pytest

import emulator  # noqa: F401  # teaches pyserial the port emulator://
from tools.identification.recording import WireRecording, read_recording
from tools.identify import main


def test_a_recording_over_a_port_is_written_whole(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "trace.csv"

    status = main(["record", "--port", "emulator://?seed=2", "--duration", "12", "--out", str(out)])

    recording = read_recording(out)
    assert status == 0
    assert isinstance(recording, WireRecording)
    assert f"{len(recording.time_s)} readings" in capsys.readouterr().out
    assert list(tmp_path.iterdir()) == [out]


def test_a_table_that_refuses_the_motion_is_no_recording(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status = main(["record", "--port", "emulator://", "--speed", "400", "--out", str(tmp_path / "trace.csv")])

    assert status == 2
    assert "out of range" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_a_useless_recording_is_refused_in_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "short.csv"
    path.write_text("time_s,command,position_deg\n0.0,P 10.0,\n0.1,H,0.0\n", encoding="ascii")

    status = main(["fit", str(path), "--out", str(tmp_path / "table.toml")])

    message = capsys.readouterr().err
    assert status == 2
    assert "1 readings in 0.0 s; required are 300 in 10 s" in message
    assert message.count("\n") == 1
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        (["--duration", "nan"], "--duration is nan; it must be within 10 to 3600"),
        (["--duration", "inf"], "--duration is inf; it must be within 10 to 3600"),
        (["--speed", "nan"], "--speed is nan; it must be at least 1"),
        (["--acceleration", "0"], "--acceleration is 0; it must be at least 1"),
        (["--baud", "-1"], "--baud is -1; it must be at least 0"),
        (["--out", "/nowhere/trace.csv"], "/nowhere is not a folder"),
    ],
)
def test_the_table_is_not_moved_for_a_recording_that_cannot_be_kept(
    options: list[str], complaint: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    status = main(["record", "--port", "/nowhere/port", "--out", str(tmp_path / "trace.csv"), *options])

    message = capsys.readouterr().err
    assert status == 2
    assert complaint in message
    assert message.count("\n") == 1


@pytest.mark.parametrize("out", ["trace.csv", "known.toml", "table.html"])
def test_a_fit_writes_over_nothing_that_it_reads(out: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("trace.csv", "known.toml"):
        (tmp_path / name).write_text("", encoding="ascii")

    status = main(
        ["fit", str(tmp_path / "trace.csv"), "--config", str(tmp_path / "known.toml"), "--out", str(tmp_path / out)]
    )

    assert status == 2
    assert f"{tmp_path / out} would be overwritten" in capsys.readouterr().err
    assert {path.name for path in tmp_path.iterdir()} == {"trace.csv", "known.toml"}
