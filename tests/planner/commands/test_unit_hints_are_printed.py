"""What `map`, `plan` and `scan` print of a scan in meters or radians, in which nothing can be reached."""

from pathlib import Path

import numpy as np
import pytest

import emulator  # noqa: F401 - teaches pyserial the port emulator://
from planner.__main__ import main
from planner.arrays import FloatArray

SCAN = """
[cell]
{cell}
[workpiece]
class = "cylinder"
diameter_mm = 100
height_mm = 100
[path]
{path}
time_step_s = 0.5
"""
RINGS = 'pattern = "rings"\nscan_speed_mm_s = 25'
QUICK = ["--angles", "8", "--configuration", "LEFTY-ABOVE-NOFLIP"]
POSES = np.array(
    [(200.0 * np.cos(a), 200.0 * np.sin(a), 50.0, np.degrees(a) + 180.0, 90.0, 0.0) for a in np.linspace(0.0, 5.0, 12)]
)
METERS, RADIANS = np.repeat((1e-3, 1.0), 3), np.repeat((1.0, np.pi / 180.0), 3)


@pytest.mark.parametrize("command", ["map", "plan", "scan"])
@pytest.mark.parametrize(
    ("cell", "scale", "expected"),
    [
        ("table_in_base = [0.57, 0, 0.12, 0, 0, 0]", None, "cell.table_in_base is 0.582 mm long: is it in meters?"),
        ("", METERS, "all poses of the path are within 0.225 mm: is it in meters?"),
        ("", RADIANS, "no pose of the path turns by more than 8.29 deg: is it in radians?"),
    ],
)
def test_the_unit_that_was_likely_meant_is_printed(
    command: str, cell: str, scale: FloatArray | None, expected: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = RINGS
    if scale is not None:
        path = 'file = "path.csv"'
        np.savetxt(tmp_path / "path.csv", POSES * scale, delimiter=",")
    file = tmp_path / "scan.toml"
    file.write_text(SCAN.format(cell=cell, path=path))
    options = ["--exact-calibration"] if command == "scan" else []
    status = main([command, str(file), *QUICK, *options, "--out", str(tmp_path / "out")])
    assert status == {"map": 0, "plan": 1, "scan": 2}[command]
    shown = capsys.readouterr()
    (line,) = (line for line in (shown.out + shown.err).splitlines() if expected in line)
    assert line.endswith("Lengths are in mm and angles in deg.")
