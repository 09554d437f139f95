import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

import emulator  # noqa: F401 - teaches pyserial the port emulator://
from planner.__main__ import main
from planner.arrays import FloatArray
from planner.cell.scan import load_scan
from planner.defaults import shipped_scans
from planner.execution.clear_path import BlockedPathError
from planner.execution.run_input import RunInput
from planner.kinematics.arm import Arm
from planner.map.synthetic_maps import blocks_map
from planner.planning import scan_planning
from planner.plans.arm_motion import ArmMotion, arm_motion
from planner.plans.plan import Plan
from planner.plans.problem import Problem
from planner.scanning import scan_run
from planner.scanning.scan_file import scan_document
from planner.scanning.scan_report import scan_report
from planner.scanning.scan_run import ScanOptions, run_on_port, scan_workpiece
from planner.table.cost import PathCost
from tests.planner.small_scan import SMALL

QUICK = ["--angles", "60", "--configuration", "LEFTY-ABOVE-NOFLIP"]
EXACT = "[gears]\nbacklash_arcmin = 0.0\n"


@pytest.fixture
def scan_file(tmp_path: Path) -> str:
    file = tmp_path / "small.toml"
    file.write_text(SMALL)
    return str(file)


def scanned(folder: Path) -> dict[str, Any]:
    document: dict[str, Any] = json.loads((folder / "scan.json").read_text())
    return document


def cloud(folder: Path) -> FloatArray:
    loaded = trimesh.load(folder / "cloud.ply")
    assert isinstance(loaded, trimesh.PointCloud)
    return np.asarray(loaded.vertices)


@pytest.mark.parametrize("name", shipped_scans())
def test_a_shipped_scan_gives_a_cloud_on_the_part_and_a_report(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["scan", name, *QUICK, "--rate", "5", "--out", str(tmp_path / "new")]) == 0
    assert sorted(file.name for file in (tmp_path / "new").iterdir()) == [
        "cloud.ply", "poses.csv", "report.html", "scan.json",
    ]  # fmt: skip
    document = scanned(tmp_path / "new")
    assert 0.0 < document["distance_mm"]["sigma"] < 0.2
    assert document["coverage"]["seen"] > 0.05
    assert document["error_mm"]["all_off"] < 1e-9
    dead_line = document["dead_line"]
    assert 0.0 < dead_line["longest_deg"] < 91.0
    assert 0 <= dead_line["forbidden_moments"] < dead_line["moments"]
    assert len(cloud(tmp_path / "new")) == document["points"]
    shown = capsys.readouterr()
    assert f"{document['points']:,} points" in shown.out
    assert f"dead line  the table would run on by up to {dead_line['longest_deg']:.0f} deg" in shown.out
    assert shown.err == ""  # a pipe shows no progress
    page = (tmp_path / "new" / "report.html").read_text()
    assert page.count('<svg role="img" aria-label="') == page.count("<svg") == 3
    assert f"<code>python -m planner scan {name} " in page
    assert "<script" not in page
    assert not re.search("https?://(?!www.w3.org/)", page)


def test_three_decimals_without_backlash_and_with_exact_calibration_lie_within_30_micrometers(
    scan_file: str, tmp_path: Path
) -> None:
    (tmp_path / "table.toml").write_text(EXACT)
    port = f"emulator://?config={tmp_path / 'table.toml'}"
    options = ["--decimals", "3", "--exact-calibration", "--port", port, "--rate", "10"]
    assert main(["scan", scan_file, *QUICK, *options, "--out", str(tmp_path)]) == 0
    document = scanned(tmp_path)
    assert 0.02 < document["distance_mm"]["sigma"] < 0.03
    parts = document["error_mm"]["parts"]
    assert parts["backlash"]["displacement_mm"] < 0.003  # to a count of the encoder


def test_encoder_and_backlash_of_the_budget_are_those_of_the_table_at_the_port(scan_file: str, tmp_path: Path) -> None:
    (tmp_path / "table.toml").write_text("[encoder]\nlines = 24\n[gears]\nbacklash_arcmin = 30.0\n")
    options = ["--decimals", "3", "--exact-calibration", "--port", f"emulator://?config={tmp_path / 'table.toml'}"]
    assert main(["scan", scan_file, *QUICK, *options, "--rate", "10", "--out", str(tmp_path)]) == 0
    error = scanned(tmp_path)["error_mm"]
    count_deg = 360.0 / (24 * 4 * 480.0)
    encoder_mm = np.radians(count_deg) / np.sqrt(12.0) * error["radius_mm"]
    assert error["parts"]["encoder"]["displacement_mm"] == pytest.approx(encoder_mm, rel=0.2)
    half_gap_mm = np.radians(0.5 * 30.0 / 60.0) * error["radius_mm"]
    assert error["parts"]["backlash"]["displacement_mm"] == pytest.approx(half_gap_mm, rel=0.1)


def test_one_decimal_costs_what_the_closed_form_says(scan_file: str, tmp_path: Path) -> None:
    assert main(["scan", scan_file, *QUICK, "--out", str(tmp_path)]) == 0
    error = scanned(tmp_path)["error_mm"]
    rounding = error["parts"]["rounding on the wire"]["displacement_mm"]
    assert rounding == pytest.approx(error["rounding_in_closed_form"], rel=0.15)
    assert error["radius_mm"] == pytest.approx(50.0, rel=0.01)


def test_the_same_command_gives_the_same_bytes_and_text_has_the_same_points(
    scan_file: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        monkeypatch.chdir(tmp_path / name)
        assert main(["scan", scan_file, *QUICK, "--rate", "4", "--xyz", "--normals", "--out", "out"]) == 0
    first, second = tmp_path / "a" / "out", tmp_path / "b" / "out"
    assert {file.name for file in first.iterdir()} == {
        "cloud.ply", "cloud.xyz", "normals.ply", "poses.csv", "scan.json", "report.html",
    }  # fmt: skip
    for file in first.iterdir():
        assert file.read_bytes() == (second / file.name).read_bytes()
    points = np.loadtxt(first / "cloud.xyz")
    assert np.abs(points - cloud(first)).max() < 1e-4


@pytest.mark.parametrize(("file", "words"), [("mesh.stl", "ends in .ply"), ("nowhere/mesh.ply", "no folder nowhere")])
def test_a_surface_that_could_not_be_written_is_refused_before_the_scan(
    file: str, words: str, scan_file: str, tmp_path: Path, capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    assert main(["scan", scan_file, "--surface", file, "--out", "out"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert words in line
    assert not (tmp_path / "out").exists()


def test_another_mesh_takes_the_place_of_the_scans(scan_file: str, tmp_path: Path) -> None:
    part = trimesh.creation.cylinder(radius=49.0, height=100.0, sections=64).apply_translation((0.0, 0.0, 50.0))
    part.export(tmp_path / "part.ply")
    options = ["--rate", "4", "--mesh", str(tmp_path / "part.ply"), "--exact-calibration"]
    assert main(["scan", scan_file, *QUICK, *options, "--out", str(tmp_path / "out")]) == 0
    vertices = cloud(tmp_path / "out")
    assert np.hypot(vertices[:, 0], vertices[:, 1]) == pytest.approx(49.0, abs=0.4)
    assert scanned(tmp_path / "out")["mesh"] == "part.ply"


def test_ctrl_c_while_profiles_are_measured_keeps_what_was_scanned(scan_file: str, tmp_path: Path) -> None:
    def stop_at_once(done: int, total: int) -> None:
        assert done < total
        raise KeyboardInterrupt

    options = ScanOptions(configuration="LEFTY-ABOVE-NOFLIP", angle_count=60, exact_calibration=True)
    result = scan_workpiece(
        load_scan(scan_file), options, tmp_path, lambda label: stop_at_once if label == "profiles" else None
    )
    assert result.is_interrupted
    assert not result.is_whole
    assert 0 < result.points == len(cloud(tmp_path)) < 640 * len(result.run.numbers)
    assert "interrupted" in scan_report(result)
    assert scan_document(result)["failure"] == "interrupted"


def without_a_triangle() -> trimesh.Trimesh:
    box = trimesh.creation.box((50.0, 50.0, 50.0))
    return trimesh.Trimesh(box.vertices, box.faces[1:], process=False)


@pytest.mark.parametrize(
    ("mesh", "message"),
    [
        (without_a_triangle(), "the mesh is open"),
        (trimesh.creation.box((0.05, 0.05, 0.05)), "is it in meters?"),
        (trimesh.creation.box((600.0, 50.0, 50.0)), "must stay within the table's radius of 250 mm"),
        (trimesh.creation.box((50.0, 50.0, 50.0)), "25.0 mm below the table's top"),
    ],
)
def test_a_mesh_that_cannot_be_meant_is_one_line_and_status_2(
    mesh: trimesh.Trimesh, message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mesh.export(tmp_path / "part.ply")
    assert main(["scan", "cylinder", "--mesh", str(tmp_path / "part.ply"), "--out", str(tmp_path / "out")]) == 2
    shown = capsys.readouterr()
    assert message in shown.err
    assert len(shown.err.splitlines()) == 1
    assert shown.out == ""
    assert not (tmp_path / "out").exists()


def test_a_scan_that_meets_nothing_says_so_and_leaves_no_cloud(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scan_file = tmp_path / "short.toml"
    scan_file.write_text(SMALL.replace("[workpiece]", "[cell.probe]\nfarthest_mm = 155\n[workpiece]"))
    # Its surface is 40 mm behind that of the cylinder which the path is made for.
    thin = trimesh.creation.cylinder(radius=10.0, height=100.0, sections=16).apply_translation((0.0, 0.0, 50.0))
    thin.export(tmp_path / "thin.ply")
    arguments = ["--mesh", str(tmp_path / "thin.ply"), "--rate", "4", "--out", str(tmp_path / "out")]
    assert main(["scan", str(scan_file), *QUICK, *arguments]) == 2
    assert "meets the workpiece" in capsys.readouterr().err
    assert list((tmp_path / "out").iterdir()) == []


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--port", "/dev/does-not-exist"], "cannot open"),
        (["--port", "emulator://?seed=x"], "cannot open"),
        (["--rate", "150"], "beyond the probe's 100"),
        (["--configuration", "SIDEWAYS"], "is not an arm configuration"),
        (["--configuration", "RIGHTY-BELOW-FLIP"], "there is no plan"),
    ],
)
def test_what_cannot_be_done_is_one_line_and_status_2(
    arguments: list[str], message: str, scan_file: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["scan", scan_file, *QUICK, *arguments, "--out", str(tmp_path / "out")]) == 2
    shown = capsys.readouterr()
    assert message in shown.err
    assert len(shown.err.splitlines()) == 1


@pytest.mark.parametrize("option", [["--rate", "0"], ["--rate", "fast"], ["--decimals", "9"], ["--seed", "-1"]])
def test_an_option_that_cannot_be_meant_is_refused(
    option: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as exit_status:
        main(["scan", "cylinder", *option, "--out", str(tmp_path)])
    assert exit_status.value.code == 2
    assert option[1] in capsys.readouterr().err


def test_a_scan_whose_arm_path_breaks_a_limit_is_refused_before_the_port_is_opened(
    scan_file: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def two_turns_on(*arguments: Any) -> ArmMotion:  # noqa: ANN401 - passed on
        found = arm_motion(*arguments)
        return replace(found, joints=found.joints + np.radians([0.0, 0.0, 0.0, 0.0, 0.0, 720.0]))

    monkeypatch.setattr(scan_planning, "arm_motion", two_turns_on)
    monkeypatch.setattr(scan_run, "open_port", lambda *_: pytest.fail("the port was opened"))
    assert main(["scan", scan_file, *QUICK, "--exact-calibration", "--out", str(tmp_path / "out")]) == 2
    shown = capsys.readouterr()
    assert "the arm cannot follow the plan: at location 0 joint 6 is at" in shown.err
    assert len(shown.err.splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_a_motion_that_the_line_cannot_carry_is_refused_before_the_port_is_opened(
    scan_file: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(scan_run, "open_port", lambda *_: pytest.fail("the port was opened"))
    assert main(["scan", scan_file, *QUICK, "--exact-calibration", "--baud", "300", "--out", str(tmp_path)]) == 2
    assert "ms at 300 baud" in capsys.readouterr().err


def test_a_run_up_through_a_forbidden_region_is_refused_before_the_port_is_opened(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    speeds = np.full(16, 20.0)
    plan = Plan("", "", 0.1, np.arange(100.0, 132.0, 2.0), speeds, np.zeros(15), PathCost(0.0, 0.0, 0.0))
    just_before = blocks_map(16, 360, [(0, 0, 96, 98)], edge=1)
    monkeypatch.setattr(scan_run, "open_port", lambda *_: pytest.fail("the port was opened"))
    planned = RunInput("", plan, Problem(just_before, 0.1), np.zeros((16, 6)), Arm.load())
    with pytest.raises(BlockedPathError, match="run-up at location 0 takes the table from 9"):
        run_on_port(planned, ScanOptions(), lambda _: None)
