"""`python -m planner scan --blind` and `--turn-over`: what is refused before the table moves."""

from pathlib import Path

import pytest

import emulator  # noqa: F401 - teaches pyserial the port emulator://
from planner.__main__ import main

SMALL = """
[cell]
workpiece_on_table = [0, 0, 80, 0, 0, 0]
[workpiece]
class = "cylinder"
diameter_mm = 100
height_mm = 60
[path]
pattern = "adaptive"
"""


@pytest.fixture
def scan_file(tmp_path: Path) -> str:
    file = tmp_path / "small.toml"
    file.write_text(SMALL)
    return str(file)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--blind", "700", "60"], "the bounding cylinder does not fit the table"),
        (["--blind", "120", "80", "--turn-over"], "--turn-over: the other face is chosen by the mesh"),
        (["--blind", "120"], "--blind: expected 2 arguments"),
        (["--blind", "120", "-5"], "--blind"),
    ],
)
def test_what_cannot_be_meant_is_refused_in_one_line(
    arguments: list[str], words: str, scan_file: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    try:
        status = main(["scan", scan_file, *arguments, "--out", str(tmp_path / "out")])
    except SystemExit as end:
        status = int(str(end.code))
    assert status == 2
    lines = capsys.readouterr().err.splitlines()
    assert words in lines[-1]
    assert not (tmp_path / "out" / "cloud.ply").exists()
