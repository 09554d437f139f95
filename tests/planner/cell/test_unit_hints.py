from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from planner.cell.scan import load_scan
from planner.cell.scan_path import ScanPath
from planner.cell.unit_hints import unit_hint
from planner.defaults import shipped_scans

BASE = """
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


def hint_of(tmp_path: Path, cell: str, path: str = RINGS) -> str | None:
    file = tmp_path / "scan.toml"
    file.write_text(BASE.format(cell=cell, path=path))
    return unit_hint(load_scan(file))


@pytest.mark.parametrize("name", shipped_scans())
def test_a_sound_scan_looks_like_no_other_unit(name: str) -> None:
    assert unit_hint(load_scan(name)) is None


@pytest.mark.parametrize(
    ("cell", "expected"),
    [
        ("table_in_base = [0.57, 0, 0.12, 0, 0, 0]", "cell.table_in_base is 0.582 mm long: is it in meters"),
        ("probe_on_flange = [0, 0, 0.1, 0, 0, 0]", "cell.probe_on_flange is 0.1 mm long: is it in meters"),
        ("workpiece_on_table = [0, 0, 0.08, 0, 0, 0]", "cell.workpiece_on_table is 0.08 mm long: is it in meters"),
        ("table_in_base = [570, 0, 120, 1.5708, 0, 0]", "cell.table_in_base turns by 1.5708 deg: is it in radians"),
        ("probe_on_flange = [0, 0, 100, 0, 3.14159, 0]", "cell.probe_on_flange turns by 3.1416 deg: is it in radians"),
    ],
)
def test_a_placement_in_meters_or_radians_is_named(tmp_path: Path, cell: str, expected: str) -> None:
    hint = hint_of(tmp_path, cell)
    assert hint is not None
    assert expected in hint
    assert hint.count("\n") == 0


def test_a_path_in_meters_or_radians_is_named(tmp_path: Path) -> None:
    azimuth = np.radians(np.arange(0.0, 360.0, 20.0))
    rows = [(200.0 * np.cos(a), 200.0 * np.sin(a), 50.0, np.degrees(a) + 180.0, 90.0, 0.0) for a in azimuth]
    for name, scale, expected in (
        ("meters", (0.001, 0.001, 0.001, 1.0, 1.0, 1.0), "within 0.2 mm: is it in meters"),
        ("radians", (1.0, 1.0, 1.0, np.pi / 180, np.pi / 180, np.pi / 180), "is it in radians"),
        ("sound", (1.0,) * 6, None),
    ):
        (tmp_path / f"{name}.csv").write_text(
            "\n".join(",".join(map(repr, np.multiply(row, scale).tolist())) for row in rows)
        )
        hint = hint_of(tmp_path, "", f'file = "{name}.csv"')
        assert hint is None if expected is None else expected in (hint or "")


def test_a_short_path_on_a_short_part_is_not_suspect() -> None:
    scan = load_scan("cylinder")
    tiny = replace(scan, predefined_path=ScanPath(scan.path.T_WS[:2], 0.1), mesh=trimesh.creation.box((1.0, 1.0, 1.0)))
    assert unit_hint(tiny) is None
