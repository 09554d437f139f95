"""A path whose beam does not meet the part is reported, with the locations."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from planner.cell.beam_check import beam_warning
from planner.cell.cell import Probe, placement
from planner.cell.scan import load_scan
from planner.defaults import shipped_scans

PART = trimesh.creation.box((100.0, 100.0, 100.0))
GOOD = placement(0.0, 0.0, 200.0, 0.0, 180.0, 0.0)
AWAY = placement(0.0, 0.0, 200.0, 0.0, 0.0, 0.0)
MISS = placement(300.0, 0.0, 200.0, 0.0, 180.0, 0.0)
FAR = placement(0.0, 0.0, 400.0, 0.0, 180.0, 0.0)


@pytest.mark.parametrize(
    ("poses", "warning"),
    [
        ([GOOD, GOOD], None),
        ([AWAY, AWAY], "the beam points away from the part at all 2 locations; the beam is the +Z axis of a pose"),
        ([GOOD, MISS], "the beam misses the part at 1 of 2 locations (the first is 1)"),
        ([MISS, MISS], "the beam misses the part at all 2 locations"),
        (
            [GOOD, GOOD, FAR, MISS],
            "the beam misses the part at 1 of 4 locations (the first is 3), and meets the part outside the measuring"
            " range of 100 to 200 mm at 1 of 4 locations (the first is 2)",
        ),
    ],
)
def test_what_the_beam_does_instead_is_named_with_its_locations(poses: list[np.ndarray], warning: str | None) -> None:
    assert beam_warning(np.array(poses), PART, Probe()) == warning


def test_one_end_of_the_laser_line_on_the_part_is_enough() -> None:
    assert beam_warning(np.array([placement(79.0, 0.0, 200.0, 0.0, 180.0, 0.0)]), PART, Probe()) is None
    assert beam_warning(np.array([placement(81.0, 0.0, 200.0, 0.0, 180.0, 0.0)]), PART, Probe()) is not None


@pytest.mark.parametrize("name", shipped_scans())
def test_the_beams_of_the_shipped_scans_meet_their_parts(name: str) -> None:
    scan = load_scan(name)
    assert beam_warning(scan.path.T_WS, scan.mesh, scan.cell.probe) is None


@pytest.mark.parametrize(("pitch_deg", "said"), [(180, []), (0, ["points away from the part at all 2 locations"])])
def test_a_path_file_that_looks_away_is_named_when_the_scan_is_loaded(
    pitch_deg: int, said: list[str], tmp_path: Path
) -> None:
    (tmp_path / "path.csv").write_text(f"0,0,250,0,{pitch_deg},0\n20,0,250,0,{pitch_deg},0\n")
    (tmp_path / "scan.toml").write_text(
        '[workpiece]\nclass = "block"\nlength_mm = 100\nwidth_mm = 100\nheight_mm = 100\n'
        '[path]\nfile = "path.csv"\ntime_step_s = 0.5\n'
    )
    lines: list[str] = []
    load_scan(tmp_path / "scan.toml", lines.append)
    assert len(lines) == len(said)
    for line, text in zip(lines, said, strict=True):
        assert line.startswith(f"{tmp_path / 'scan.toml'}: path: the beam {text}")
