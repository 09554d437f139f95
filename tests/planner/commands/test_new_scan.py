"""From a new mesh to a verified plan: `new-scan`, `plan`, `run`."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

import planner
from planner.__main__ import main
from planner.cell.scan_draft import Part, drafts
from planner.commands.new_scan import first_that_plans, has_room, share_missed
from planner.defaults import AXES, PATTERN_NAMES
from planner.geometry.mesh import load_mesh
from planner.kinematics.arm import Arm
from planner.map.config_map import ConfigurationMap
from planner.plans.arm_motion import ArmMotion
from tests.planner.own_parts import OWN_PARTS

MESHES = Path(__file__).parents[1] / "meshes"
FOREIGN = {"angle_block": ("--unit", "inch"), "plate_holes": ()}


def new_scan(mesh: Path, *options: str) -> Path | None:
    """Return the scan file that `new-scan` writes for a mesh, in the same folder."""
    scan = mesh.with_suffix(".toml")
    return scan if main(["new-scan", str(mesh), *options, "--out", str(scan)]) == 0 else None


@pytest.mark.parametrize("name", OWN_PARTS)
def test_a_part_gets_a_scan_that_plans(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    own = OWN_PARTS[name]
    own.mesh.export(tmp_path / "part.stl")
    scan = new_scan(tmp_path / "part.stl", *own.options)
    assert scan is not None
    shown = capsys.readouterr().out
    assert f"part.toml: {own.name}, " in shown
    unit = own.options[1] if "--unit" in own.options else "mm"
    for assumed in (
        f"lengths in {unit} (--unit)",
        "of the file points up (--up)",
        "workpiece_on_table =",
        "stand-off 150 mm",
    ):
        assert assumed in shown
    checked = re.search(r"checked: a plan exists in (\S+)", shown)
    assert checked is not None
    planned = planner.plan(planner.load_scan(scan), configuration=checked[1])
    assert isinstance(planned, planner.PlannedScan)
    assert planned.is_executable


@pytest.mark.parametrize("name", FOREIGN)
def test_three_commands_lead_from_a_mesh_to_a_verified_run(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["new-scan", str(MESHES / f"{name}.stl"), *FOREIGN[name]]) == 0
    printed = re.search(r"next: +python -m planner (plan .*)\n +python -m planner (run .*)\n", capsys.readouterr().out)
    assert printed is not None
    assert main([*printed[1].split(), "--configuration", "LEFTY-ABOVE-NOFLIP"]) == 0
    assert main(printed[2].split()) == 0
    assert "\nverified: within " in capsys.readouterr().out


def test_a_pattern_that_measures_little_is_not_the_first_choice() -> None:
    bracket = Part(OWN_PARTS["bracket"].mesh, Path("part.stl"))
    first = next(iter(drafts(bracket)))
    assert first.pattern == "rings"
    assert share_missed(first) > 0.4  # between base and wall there is nothing
    chosen = first_that_plans(bracket, None, None, "part").draft
    assert share_missed(chosen) < 0.1


@pytest.mark.parametrize(("angle_deg", "has"), [(100.0, False), (100.4, True), (250.0, False), (249.6, True)])
def test_a_plan_has_room_where_the_table_may_be_a_little_beside_it(angle_deg: float, has: bool) -> None:
    values = np.ones((5, 36))
    values[2, :10], values[2, 26:] = 0.0, 0.0  # free from 100 to 250 degrees
    problem = planner.Problem(ConfigurationMap(values), step_s=0.5)
    standing = planner.make_plan(problem, "still", np.full(5, angle_deg), np.zeros(5), np.zeros(4))
    arm = ArmMotion(Arm.load(), np.zeros((5, 6)), np.zeros((5, 6)), np.zeros(6, dtype=np.int64))
    assert has_room(problem, standing, arm) is has
    assert not has_room(problem, standing, replace(arm, step=1))


def test_the_file_says_the_same_as_the_scan_that_was_checked(tmp_path: Path) -> None:
    for name in ("bracket", "set upright", "off center"):
        own = OWN_PARTS[name]
        own.mesh.export(tmp_path / "part.ply")
        mesh = load_mesh(tmp_path / "part.ply")
        for draft in drafts(Part(mesh, tmp_path / "part.ply", up="y" if own.options else "z")):
            (tmp_path / "scan.toml").write_text(draft.text(tmp_path), encoding="utf-8")
            scan, read = draft.scan("scan"), planner.load_scan(tmp_path / "scan.toml")
            np.testing.assert_array_equal(read.path.T_WS, scan.path.T_WS)
            np.testing.assert_array_equal(read.cell.T_TW, scan.cell.T_TW)
            assert (read.path.step_s, read.workpiece, read.limits, read.weights, read.value) == (
                scan.path.step_s, scan.workpiece, scan.limits, scan.weights, scan.value
            )  # fmt: skip


@pytest.mark.parametrize("pattern", PATTERN_NAMES)
def test_every_pattern_can_be_laid_on_a_mesh(pattern: str) -> None:
    part = Part(OWN_PARTS["bracket"].mesh, Path("part.stl"))
    for draft in drafts(part, pattern=pattern):
        assert draft.pattern == pattern
        assert draft.scan("scan").path.count >= 20


@pytest.mark.parametrize("up", AXES)
def test_the_axis_that_points_up_is_turned_upwards_and_the_part_stands_in_the_middle(up: str) -> None:
    mesh = trimesh.creation.box((40.0, 60.0, 100.0)).apply_translation((30.0, 7.0, -200.0))
    part = Part(mesh, Path("part.stl"), up=up)
    T_TW = part.cell.T_TW
    axis = np.eye(3)["xyz".index(up[-1])] * (-1.0 if up.startswith("-") else 1.0)
    np.testing.assert_allclose(T_TW[:3, :3] @ axis, (0.0, 0.0, 1.0), atol=1e-12)
    placed = np.asarray(mesh.vertices) @ T_TW[:3, :3].T + T_TW[:3, 3]
    np.testing.assert_allclose(placed.min(axis=0) + placed.max(axis=0), (0.0, 0.0, np.ptp(placed[:, 2])), atol=2e-3)
    assert placed[:, 2].min() == pytest.approx(0.0, abs=1e-3)


def without_a_triangle() -> trimesh.Trimesh:
    whole = trimesh.creation.box((80.0, 80.0, 80.0))
    return trimesh.Trimesh(whole.vertices, whole.faces[1:], process=False)


@pytest.mark.parametrize(
    ("mesh", "options", "message"),
    [
        (trimesh.creation.box((600.0, 80.0, 80.0)), (), r"extends 302\.7 mm from the table's axis"),
        (trimesh.creation.box((1600.0, 80.0, 80.0)), (), r"longest side is 1600 mm; allowed: 10 to 1000 mm"),
        (trimesh.creation.box((0.08, 0.08, 0.08)), (), r"is it in meters\? Then set unit"),
        (without_a_triangle(), (), r"the mesh is open at 3 edges"),
        (trimesh.creation.box((80.0, 80.0, 80.0)), ("--class", "mould"), r"no cavity in the middle of its top"),
    ],
)
def test_what_cannot_be_scanned_is_refused_in_one_sentence(
    mesh: trimesh.Trimesh, options: tuple[str, ...], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mesh.export(tmp_path / "part.stl")
    assert new_scan(tmp_path / "part.stl", *options) is None
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"planner new-scan: {tmp_path / 'part.stl'}: ")
    assert re.search(message, line)
    assert sorted(tmp_path.iterdir()) == [tmp_path / "part.stl"]


def test_a_part_that_the_arm_cannot_reach_is_refused_with_what_was_tried(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    trimesh.creation.cylinder(radius=40.0, height=800.0).export(tmp_path / "part.stl")
    assert new_scan(tmp_path / "part.stl", "--pattern", "raster") is None
    (line,) = capsys.readouterr().err.splitlines()
    assert "no pattern can be scanned in the default cell (raster: " in line
    assert "a scan location has no allowed table angle" in line
    assert not (tmp_path / "part.toml").exists()


def test_a_file_that_is_not_a_mesh_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "part.stl").write_text("a shopping list", encoding="utf-8")
    assert new_scan(tmp_path / "part.stl") is None
    assert "this is not an STL file" in capsys.readouterr().err


def test_an_existing_file_is_not_overwritten(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    OWN_PARTS["cone"].mesh.export(tmp_path / "part.stl")
    (tmp_path / "part.toml").write_text("mine", encoding="utf-8")
    assert new_scan(tmp_path / "part.stl") is None
    assert "part.toml: already exists; remove it, or choose another file with --out" in capsys.readouterr().err
    assert (tmp_path / "part.toml").read_text(encoding="utf-8") == "mine"
