import re
from pathlib import Path

import numpy as np
import pytest
import trimesh

from planner.cell.scan import load_scan
from planner.defaults import shipped_scans
from planner.errors import PlannerError, ScanFileError, WorkpieceError
from planner.kinematics.inverse_kinematics import inverse_kinematics
from planner.reasons import Reason
from tests.planner.goals import goal_flange_poses

SCANS = Path(__file__).parents[3] / "planner" / "scans"


def changed(folder: Path, name: str, old: str, new: str) -> Path:
    """Return a copy of a shipped scan with one text replaced."""
    text = (SCANS / f"{name}.toml").read_text()
    assert old in text
    file = folder / "scan.toml"
    file.write_text(text.replace(old, new, 1))
    return file


def test_four_scans_are_shipped() -> None:
    assert shipped_scans() == ["cylinder", "mould", "mould-crossed", "sphere"]


@pytest.mark.parametrize("name", shipped_scans())
def test_a_shipped_scan_has_about_a_hundred_locations_each_reached_at_some_table_angle(name: str) -> None:
    scan = load_scan(name)
    assert scan.name == name
    assert 90 <= scan.path.count <= 110
    goals = goal_flange_poses(scan.cell, scan.path.T_WS, np.arange(0.0, 360.0, 10.0))
    _, reasons = inverse_kinematics(scan.cell.arm, goals.reshape(-1, 4, 4))
    reached = (reasons == Reason.REACHED).reshape(*goals.shape[:2], 8)
    assert reached.any(axis=1).all(axis=0).any(), "no configuration reaches every location"
    assert not reached.all(axis=1).all(axis=0).any(), "the map of some configuration forbids nothing"


@pytest.mark.parametrize("name", ["sphere", "cylinder"])
def test_going_round_a_workpiece_needs_the_table_to_turn(name: str) -> None:
    scan = load_scan(name)
    goals = goal_flange_poses(scan.cell, scan.path.T_WS, np.arange(0.0, 360.0, 5.0))
    _, reasons = inverse_kinematics(scan.cell.arm, goals.reshape(-1, 4, 4))
    reached = (reasons == Reason.REACHED).reshape(*goals.shape[:2], 8)
    assert not reached.all(axis=0).any(), "one table angle serves the whole path"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "diameter_mm = 160",
            "diameter_cm = 16",
            "workpiece.diameter_mm is missing; it must be a finite number above 0",
        ),
        ("diameter_mm = 160", "diameter_mm = 160\ncolor = 1", "workpiece.color is not a known key; known are class,"),
        (
            "diameter_mm = 160",
            "diameter_mm = -160",
            "workpiece.diameter_mm is -160; it must be a finite number above 0",
        ),
        ("diameter_mm = 160", 'diameter_mm = "160"', "workpiece.diameter_mm is '160'; it must be a finite number"),
        ("diameter_mm = 160", "diameter_mm = true", "workpiece.diameter_mm is True"),
        ("diameter_mm = 160", "diameter_mm = nan", "workpiece.diameter_mm is nan"),
        (
            "overlap = 0.2",
            "overlap = 1.5",
            "path.overlap is 1.5; it must be a finite number at least 0 and at most 0.9",
        ),
        ('"meridians"', '"zigzag"', "path.pattern is 'zigzag'; it must be one of adaptive, meridians, spiral"),
        ('"sphere"', '"egg"', "workpiece.class is 'egg'; it must be one of block, cylinder, mould, sphere"),
        ("[0, 0, 60, 0, 0, 0]", "[0, 0, 60]", "cell.workpiece_on_table is [0, 0, 60]; it must be a list of 6"),
        (
            "lowest_polar_deg = 85",
            "lowest_polar_deg = 5",
            "path.lowest_polar_deg is 5; it must be a finite number above 10",
        ),
        ("comfortable_clearance_mm = 30", "comfortable_clearance_mm = 4", "the first must be smaller"),
        ("0.2, 0.2]", "0.2, -1]", "required are 8 finite numbers"),
        ("table_speed_deg_s = 40", "table_speed_deg_s = 0", "limits.table_speed_deg_s is 0; it must be"),
        (
            "[limits]",
            "[limit]",
            "limit is not a known key; known are cell, limits, path, value, weights, work",
        ),
        ("[workpiece]", "[workpeice]", "workpeice is not a known key; known are cell, limits, path, value,"),
        ("[workpiece]", "[WORKPIECE]", "value, weights, workpiece; did you mean workpiece?"),
        ("[workpiece]", "[part]", "part is not a known key; known are cell,"),
        ("class =", "clas =", "workpiece.clas is not a known key; did you mean class? workpiece.class is missing"),
        (
            "scan_speed_mm_s = 30",
            "scan_speed_mm_s = 1e-6",
            "2.98e+09 locations; at most 20,000 are allowed; increase",
        ),
        ("scan_speed_mm_s = 30", "scan_speed_mm_s = 5e-324", "has inf locations; at most 20,000 are allowed"),
        (
            "time_step_s = 0.5",
            "time_step_s = 1e-6",
            "locations; at most 20,000 are allowed; increase the speed or the time",
        ),
        (
            "[cell]",
            "[cell.probe]\nline_width_mm = 1e-6\n[cell]",
            "the pattern has more than 1,000 strips; check the",
        ),
        *(
            ("[cell]", f"[cell.table]\n{key} = {number}\n[cell]", f"cell.table.{key} is {number}; it must be a finite")
            for key in ("radius_mm", "thickness_mm", "plinth_radius_mm")
            for number in ("0", "-1", "inf")
        ),
        ("[limits]", "[limits", "is not TOML"),
        (
            '"viper_s650"',
            '"second"',
            "cell.arm is 'second'; it must be a file beside the scan, or one of kuka_kr6_r700, viper_s650",
        ),
        ('"viper_s650"', '"viper_s65"', "one of kuka_kr6_r700, viper_s650; did you mean viper_s650?"),
        (
            '"viper_s650"',
            '"viper_s650"\nbodies = "second"',
            "cell.bodies is 'second'; it must be a file beside the scan, or one of kuka_kr6_r700, viper_s650",
        ),
        (
            "diameter_mm = 160",
            "diameter_mm = 0.16",
            "longest side is 0.16 mm; allowed: 10 to 1000 mm; is it in meters?",
        ),
        ("diameter_mm = 160", "diameter_mm = 510", "extends 255.0 mm from the table's axis"),
        ("[0, 0, 60, 0, 0, 0]", "[0, 0, -60, 0, 0, 0]", "extends 60.0 mm below the table's top"),
        ("[cell]", "[cell.probe]\nstand_off_mm = 250\n[cell]", "cell.probe.stand_off_mm is 250; it must be"),
        ("[cell]", "[cell.probe]\nnearest_mm = 300\n[cell]", "cell.probe.farthest_mm is missing; it must be"),
    ],
)
def test_a_wrong_key_unit_or_range_is_refused_with_file_key_and_what_is_allowed(
    tmp_path: Path, old: str, new: str, message: str
) -> None:
    file = changed(tmp_path, "sphere", old, new)
    with pytest.raises(PlannerError, match=re.escape(message)) as refusal:
        load_scan(file)
    assert str(refusal.value).startswith(f"{file}: ")


def test_a_name_that_is_neither_shipped_nor_a_file_is_refused_with_the_shipped_ones() -> None:
    with pytest.raises(ScanFileError, match="cylinder, mould, mould-crossed, sphere"):
        load_scan("cone")


def test_arm_limits_in_the_wrong_order_are_refused(tmp_path: Path) -> None:
    arm = (SCANS.parent / "arms" / "viper_s650.toml").read_text()
    (tmp_path / "arm.toml").write_text(arm.replace("[-190, 45]", "[45, -190]"))
    file = changed(tmp_path, "sphere", '"viper_s650"', '"arm.toml"')
    with pytest.raises(PlannerError, match=r"limits of joint 2 are 45..-190 deg; the lower must come first") as refusal:
        load_scan(file)
    assert str(refusal.value).startswith(f"{file}: ")


def test_a_mesh_is_scanned_by_its_measured_dimensions(tmp_path: Path) -> None:
    load_scan("cylinder").mesh.export(tmp_path / "part.stl")
    file = changed(tmp_path, "cylinder", "diameter_mm = 140\nheight_mm = 180", 'mesh = "part.stl"')
    np.testing.assert_allclose(load_scan(file).path.T_WS, load_scan("cylinder").path.T_WS, atol=0.2)


def test_a_mesh_of_no_class_is_scanned_along_a_path_from_a_file(tmp_path: Path) -> None:
    trimesh.creation.box((80.0, 80.0, 80.0)).apply_translation((0.0, 0.0, 40.0)).export(tmp_path / "part.stl")
    (tmp_path / "path.csv").write_text("0,0,230,0,180,0\n20,0,230,0,180,0\n")
    text = '[workpiece]\nmesh = "part.stl"\n[path]\nfile = "path.csv"\ntime_step_s = 0.5\n'
    (tmp_path / "scan.toml").write_text(text)
    scan = load_scan(tmp_path / "scan.toml")
    assert scan.workpiece is None
    assert scan.path.count == 2


def test_a_mesh_of_no_class_needs_a_path_file(tmp_path: Path) -> None:
    trimesh.creation.box((80.0, 80.0, 80.0)).apply_translation((0.0, 0.0, 40.0)).export(tmp_path / "part.stl")
    (tmp_path / "scan.toml").write_text('[workpiece]\nmesh = "part.stl"\n[path]\ntime_step_s = 0.5\n')
    with pytest.raises(ScanFileError, match=r"path.file is missing; it must be a path file, unless path.pattern is"):
        load_scan(tmp_path / "scan.toml")


def test_a_fault_of_the_mesh_names_both_files(tmp_path: Path) -> None:
    trimesh.creation.box((0.08, 0.08, 0.08)).export(tmp_path / "part.stl")
    file = changed(tmp_path, "cylinder", "diameter_mm = 140\nheight_mm = 180", 'mesh = "part.stl"')
    with pytest.raises(WorkpieceError, match="is it in meters") as refusal:
        load_scan(file)
    assert "scan.toml" in str(refusal.value)
    assert "part.stl" in str(refusal.value)


def test_the_unit_of_a_mesh_is_a_key_of_the_workpiece(tmp_path: Path) -> None:
    inches = load_scan("cylinder").mesh.copy()
    inches.vertices /= 25.4
    inches.export(tmp_path / "part.stl")
    file = changed(tmp_path, "cylinder", "diameter_mm = 140\nheight_mm = 180", 'mesh = "part.stl"')
    with pytest.raises(WorkpieceError, match=r"or inches\? Then set unit in \[workpiece\]"):
        load_scan(file)
    file.write_text(file.read_text().replace('mesh = "part.stl"', 'mesh = "part.stl"\nunit = "inch"'))
    np.testing.assert_allclose(load_scan(file).mesh.extents, load_scan("cylinder").mesh.extents, rtol=1e-6)
    file.write_text(file.read_text().replace('"inch"', '"furlong"'))
    with pytest.raises(ScanFileError, match=r"workpiece.unit is 'furlong'; it must be one of mm, cm, m, inch"):
        load_scan(file)


def test_what_is_mended_in_a_mesh_is_said(tmp_path: Path) -> None:
    mesh = load_scan("cylinder").mesh.copy()
    mesh.invert()
    mesh.export(tmp_path / "part.stl")
    file = changed(tmp_path, "cylinder", "diameter_mm = 140\nheight_mm = 180", 'mesh = "part.stl"')
    said: list[str] = []
    load_scan(file, said.append)
    load_scan("cylinder", said.append)
    assert said == [f"{tmp_path / 'part.stl'}: turned {len(mesh.faces)} inside-out triangles"]


def test_another_arm_without_bodies_is_refused_with_how_to_give_them(tmp_path: Path) -> None:
    (tmp_path / "other.toml").write_text((SCANS.parent / "arms" / "viper_s650.toml").read_text())
    file = changed(tmp_path, "sphere", '"viper_s650"', '"other.toml"')
    with pytest.raises(
        ScanFileError, match=r"cell.bodies is missing; it must be the file of the collision bodies"
    ) as refusal:
        load_scan(file)
    assert "kuka_kr6_r700, viper_s650 from planner/bodies/" in str(refusal.value)
    file.write_text(file.read_text().replace('"other.toml"', '"other.toml"\nbodies = "viper_s650"'))
    assert load_scan(file).bodies.parts[0].radius_mm == 90.0


def test_a_shipped_arm_brings_its_own_bodies(tmp_path: Path) -> None:
    scan = load_scan(changed(tmp_path, "sphere", '"viper_s650"', '"kuka_kr6_r700"'))
    assert scan.cell.arm.name == "KUKA KR 6 R700 sixx"
    assert scan.bodies.parts[0].radius_mm == 130.0
