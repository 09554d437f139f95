from pathlib import Path

import pytest

from emulator.config import load_config
from tools.tune import main


def test_the_command_line_writes_gains_header_report_and_plots(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    status = main(["--plants", "20", "--out", str(tmp_path / "out")])

    assert status == 0
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert names == {"gains.toml", "gains.h", "report.html", "answers.svg", "bode.svg", "nyquist.svg", "spread.svg"}
    assert "ramp set: K " in capsys.readouterr().out
    load_config(tmp_path / "out" / "gains.toml")
    report = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert report.count("<svg") == 4
    assert "src=" not in report  # nothing is fetched from elsewhere


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        (["--ms", "1"], "--ms is 1; it must be greater than 1"),
        (["--noise", "0"], "--noise is 0; it must be greater than 0"),
        (["--plants", "0"], "--plants must be at least 1"),
        (["--config", "/nowhere/table.toml"], "/nowhere/table.toml: cannot be read"),
        (["--bandwidth", "200"], "best that can be had is bandwidth 28 Hz (asked is at least 200 Hz)"),
    ],
)
def test_what_cannot_be_done_is_said_in_one_line(
    options: list[str], complaint: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    status = main([*options, "--out", str(tmp_path / "out")])

    message = capsys.readouterr().err
    assert status == 2
    assert complaint in message
    assert message.count("\n") == 1
    assert not (tmp_path / "out").exists()
