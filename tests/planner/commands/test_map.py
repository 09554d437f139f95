from pathlib import Path

import pytest
import trimesh

from planner.__main__ import main
from planner.cell.scan import load_scan
from planner.cell.workpiece import Cylinder
from planner.kinematics.configuration import Configuration
from planner.map.map_builder import build_maps
from planner.map.map_file import load_maps
from planner.map.map_problem import map_problem

SMALL = ["--angles", "24"]


def test_a_shipped_scan_gives_map_pictures_and_summary(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["map", "cylinder", *SMALL, "--out", str(tmp_path / "new" / "folder")]) == 0
    files = sorted(file.name for file in (tmp_path / "new" / "folder").iterdir())
    assert files == ["map.npz", "map.png", "map_cylinder.png"]
    maps = load_maps(tmp_path / "new" / "folder" / "map.npz")
    assert list(maps) == list(Configuration)
    shown = capsys.readouterr()
    assert shown.err == ""
    for configuration, each in maps.items():
        (line,) = (line for line in shown.out.splitlines() if line.startswith(configuration.label))
        assert f"{1 - len(each.blocked_locations) / each.location_count:.1%}" in line
        assert line.endswith("none") == (not each.blocked_locations)
    assert shown.out.splitlines()[-1] == "drawn: LEFTY-ABOVE-NOFLIP"


def test_one_configuration_can_be_asked_for(tmp_path: Path) -> None:
    assert main(["map", "cylinder", *SMALL, "--configuration", "righty-above-flip", "--out", str(tmp_path)]) == 0
    assert list(load_maps(tmp_path / "map.npz")) == [Configuration.RIGHTY_ABOVE_FLIP]


def test_the_same_scan_gives_the_same_bytes(tmp_path: Path) -> None:
    for name in ("a", "b"):
        assert main(["map", "cylinder", *SMALL, "--out", str(tmp_path / name)]) == 0
    for file in (tmp_path / "a").iterdir():
        assert file.read_bytes() == (tmp_path / "b" / file.name).read_bytes()


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["map", "nosuch"], "nosuch"),
        (["map", "cylinder", "--configuration", "SIDEWAYS"], "SIDEWAYS"),
    ],
)
def test_bad_input_is_one_sentence_status_2_and_no_file(
    arguments: list[str], told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*arguments, "--out", str(tmp_path / "out")]) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert told in shown.err
    assert len(shown.err.splitlines()) == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("angles", ["7", "36001", "many", "-3"])
def test_a_number_of_angles_that_cannot_be_meant_is_refused(
    angles: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as stop:
        main(["map", "cylinder", f"--angles={angles}", "--out", str(tmp_path)])
    assert stop.value.code == 2
    assert "8 to 36000" in capsys.readouterr().err


def test_a_folder_that_cannot_be_made_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "file").write_text("not a folder")
    assert main(["map", "cylinder", *SMALL, "--out", str(tmp_path / "file" / "out")]) == 2
    assert "cannot write" in capsys.readouterr().err


SCAN_OF_A_MESH = """
[workpiece]
class = "cylinder"
mesh = "part.stl"
[path]
pattern = "rings"
bottom_margin_mm = 60
scan_speed_mm_s = 60
time_step_s = 1
"""


def scan_of(mesh: trimesh.Trimesh, folder: Path) -> Path:
    mesh.export(folder / "part.stl")
    (folder / "scan.toml").write_text(SCAN_OF_A_MESH)
    return folder / "scan.toml"


def test_what_is_mended_in_a_mesh_is_one_line_on_stderr(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    part = Cylinder(140.0, 150.2).mesh()
    part.invert()
    assert main(["map", str(scan_of(part, tmp_path)), *SMALL, "--out", str(tmp_path)]) == 0
    shown = capsys.readouterr()
    assert shown.err == f"{tmp_path / 'part.stl'}: turned {len(part.faces)} inside-out triangles\n"


def test_a_mesh_that_cannot_be_used_is_one_line_and_status_2(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = scan_of(Cylinder(140.0, 150.2).mesh(), tmp_path)
    for content in (b"", b"solid \xe4\n", (tmp_path / "part.stl").read_bytes()[:-60]):
        (tmp_path / "part.stl").write_bytes(content)
        assert main(["map", str(file), *SMALL, "--out", str(tmp_path / "out")]) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert line.startswith(f"planner map: {file}: {tmp_path / 'part.stl'}: ")
        assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("height_mm", [150.0, 150.2, 150.4, 163.7, 181.3])
def test_a_cylinder_of_any_height_is_reached_as_well(height_mm: float, tmp_path: Path) -> None:
    scan = load_scan(scan_of(Cylinder(140.0, height_mm).mesh(), tmp_path))
    slot = Configuration.LEFTY_ABOVE_NOFLIP
    assert build_maps(map_problem(scan), [slot], 48)[slot].blocked_locations == ()
