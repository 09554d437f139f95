from pathlib import Path

import pytest

from planner.__main__ import main
from planner.kinematics.configuration import Configuration
from planner.map.map_file import load_maps

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
    assert "cannot be written" in capsys.readouterr().err
