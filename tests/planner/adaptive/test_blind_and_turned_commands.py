"""`--blind` and `--turn-over` from the scan file to the report, on a small part of few faces."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import emulator  # noqa: F401 - teaches pyserial the port emulator://
from planner.__main__ import main
from planner.adaptive import known_part
from planner.geometry.mesh import load_mesh
from planner.geometry.thinned_cloud import ThinnedCloud
from planner.scanning.error_budget import signed_distances_mm
from planner.scanning.point_cloud import read_cloud
from tests.planner.adaptive.adaptive_parts import lump

PART = """
[workpiece]
mesh = "lump.stl"
[path]
pattern = "adaptive"
"""
QUICK = ["--angles", "90", "--exact-calibration"]


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Few candidates."""
    monkeypatch.setattr(known_part, "_ROUNDS", ((16, 3),))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    lump().export(tmp_path / "lump.stl")
    (tmp_path / "part.toml").write_text(PART)
    return tmp_path


def scan(folder: Path, *more: str) -> int:
    return main(["scan", str(folder / "part.toml"), *QUICK, *more, "--out", str(folder / "out")])


def document(folder: Path) -> dict[str, Any]:
    loaded: dict[str, Any] = json.loads((folder / "out" / "scan.json").read_text())
    return loaded


def off_mm(folder: Path, points: np.ndarray[Any, Any]) -> float:
    """Return the mean distance of points from the part."""
    some = points[:: max(1, len(points) // 300)]
    mesh = load_mesh(folder / "lump.stl")
    return float(np.abs(signed_distances_mm(mesh, some)).mean())


def test_a_blind_scan_sees_much_of_a_part_and_verifies_each_strip(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert scan(folder, "--blind", "110", "90", "--most-strips", "2") == 0
    found = document(folder)["adaptive"]
    assert len(found["strips"]) == 2
    assert all(strip["verdict"].startswith("verified") for strip in found["strips"])
    assert found["seen_of_visible"] > 0.3
    assert found["seen_after"] == sorted(found["seen_after"])
    assert off_mm(folder, read_cloud(folder / "out" / "cloud.ply")[0]) < 0.1
    assert "of what can be seen" in capsys.readouterr().out
    assert "What stays unseen" in (folder / "out" / "report.html").read_text()


def test_a_cylinder_that_is_too_small_ends_a_blind_scan_and_the_data_are_kept(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert scan(folder, "--blind", "110", "30", "--most-strips", "3") == 2
    shown = capsys.readouterr()
    assert "mm above the bounding cylinder of 110 x 30 mm" in shown.err
    assert "what was scanned is in" in shown.err
    found = document(folder)
    assert found["points"] > 1000
    # Nobody has computed what can be seen, so no share of it is claimed.
    assert found["adaptive"]["seen_of_visible"] is None
    assert "of what can be seen" not in shown.out


def test_two_placements_are_joined_and_the_joined_cloud_lies_on_the_part(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("small_gicp")
    assert scan(folder, "--adapt", "0.9", "--turn-over") == 0
    found = document(folder)
    turned = found["turned_over"]
    assert turned["seen_of_whole"] > found["adaptive"]["seen_of_whole"]
    assert turned["overlap"] > 0.15
    points, _ = read_cloud(folder / "out" / "joined.ply")
    assert off_mm(folder, points) < 0.1
    # The second placement brought points of the face that the part stood on.
    thinned = ThinnedCloud(2.0)
    thinned.take(points, np.tile((0.0, 0.0, -1.0), (len(points), 1)))
    assert (thinned.points[:, 2] < 0.5).mean() > 0.02
    assert "joined on an overlap of" in capsys.readouterr().out
    assert json.loads((folder / "out" / "turned" / "scan.json").read_text())["points"] > 1000


def test_results_of_a_second_placement_do_not_stay_beside_those_of_a_scan_without_one(folder: Path) -> None:
    turned = folder / "out" / "turned"
    turned.mkdir(parents=True)
    (turned / "scan.json").write_text("of an earlier scan")
    assert scan(folder, "--mesh", str(folder / "missing.stl")) == 2
    assert not (turned / "scan.json").exists()
    assert (turned / "previous" / "scan.json").read_text() == "of an earlier scan"
