import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

import emulator  # noqa: F401 - teaches pyserial the port emulator://
from planner.__main__ import main
from planner.adaptive import known_part, table_carrier
from planner.adaptive.known_part import KnownPart
from planner.adaptive.policy import Returned
from planner.adaptive.strip import Strip
from planner.adaptive.table_carrier import TableCarrier
from planner.cell.obstacles import Obstacle
from planner.scanning.latched_run import LatchedRun
from planner.scanning.measuring import Measuring
from planner.scanning.scan_run import run_on_table
from protocol import TableError
from tests.planner.adaptive.adaptive_parts import cup

PART = """
[workpiece]
mesh = "cup.stl"
[path]
pattern = "adaptive"
"""
WITH_PATH = """
[workpiece]
mesh = "cup.stl"
class = "cylinder"
[path]
pattern = "rings"
bottom_margin_mm = 50
scan_speed_mm_s = 25
time_step_s = 0.5
"""
QUICK = ["--angles", "120", "--configuration", "LEFTY-ABOVE-NOFLIP", "--exact-calibration"]


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Few candidates."""
    monkeypatch.setattr(known_part, "_ROUNDS", ((20, 3),))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    cup().export(tmp_path / "cup.stl")
    (tmp_path / "part.toml").write_text(PART)
    (tmp_path / "rings.toml").write_text(WITH_PATH)
    return tmp_path


def scan(folder: Path, name: str, *more: str) -> int:
    return main(["scan", str(folder / name), *QUICK, *more, "--out", str(folder / "out")])


def document(folder: Path) -> dict[str, Any]:
    loaded: dict[str, Any] = json.loads((folder / "out" / "scan.json").read_text())
    return loaded


def test_an_adaptive_scan_sees_what_can_be_seen_and_verifies_each_strip(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert scan(folder, "part.toml", "--adapt", "0.6") == 0
    shown = capsys.readouterr()
    found = document(folder)["adaptive"]
    assert found["seen_of_visible"] >= 0.6
    assert found["seen_of_whole"] == pytest.approx(found["seen_of_visible"] * found["visible_of_whole"], rel=1e-6)
    assert not found["path"]
    assert all(strip["verdict"].startswith("verified") for strip in found["strips"])
    assert found["seen_after"] == sorted(found["seen_after"])
    assert found["seen_after"][-1] == pytest.approx(found["seen_of_whole"])
    assert found["duration_s"] > sum(sum(strip["transfer"]["moves_s"]) for strip in found["strips"])
    unseen = {region["reason"] for region in found["unseen"]}
    assert "never_in_view" in unseen  # the bottom
    assert f"with {len(found['strips'])} strips; the session takes" in shown.out
    assert "cm²" in shown.out
    cloud = trimesh.load(folder / "out" / "cloud.ply")
    assert isinstance(cloud, trimesh.PointCloud)
    assert len(cloud.vertices) == document(folder)["points"]
    page = (folder / "out" / "report.html").read_text()
    assert page.count("<svg") >= 4
    assert "What stays unseen" in page
    # Profiles are numbered on from strip to strip.
    numbers = document(folder)["profiles"]["number"]
    assert numbers == sorted(set(numbers))


def test_strips_come_after_the_predefined_path_and_no_more_than_allowed(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert scan(folder, "rings.toml", "--adapt", "1", "--most-strips", "1") == 1
    found = document(folder)["adaptive"]
    assert found["path"]
    assert len(found["strips"]) == 1
    assert len(found["seen_after"]) == 2
    assert 0.2 < found["seen_after"][0] < found["seen_after"][1]
    shown = capsys.readouterr().out
    assert "1 strip after the path" in shown
    assert "Wanted were 100.0%: all strips that were allowed are scanned (--most-strips)" in shown


def test_ctrl_c_keeps_what_was_scanned(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    take = KnownPart.take

    def interrupted(self: KnownPart, strip: Strip | None, returned: Returned) -> None:
        take(self, strip, returned)
        raise KeyboardInterrupt

    monkeypatch.setattr(KnownPart, "take", interrupted)
    assert scan(folder, "part.toml", "--adapt", "0.8") == 1  # a real signal makes it 130
    found = document(folder)
    assert len(found["adaptive"]["strips"]) == 1
    assert found["points"] > 1000
    assert "It ended early: interrupted" in (folder / "out" / "report.html").read_text()


def test_ctrl_c_while_a_strip_is_measured_keeps_the_profiles_until_then(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    measure, calls = Measuring._measure, 0  # noqa: SLF001 - a place in the middle of a strip

    def interrupted(self: Measuring, *arguments: Any) -> Any:  # noqa: ANN401 - passed on
        nonlocal calls
        calls += 1
        if calls == 2:
            raise KeyboardInterrupt
        return measure(self, *arguments)

    monkeypatch.setattr(Measuring, "_measure", interrupted)
    assert scan(folder, "part.toml", "--adapt", "0.8") == 1
    assert document(folder)["points"] > 1000


def test_a_cloud_that_does_not_fit_the_mesh_is_refused_and_kept(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = cup()
    other.vertices = np.asarray(other.vertices) * (1.1, 1.1, 1.0)
    other.export(folder / "other.stl")
    assert scan(folder, "part.toml", "--adapt", "0.8", "--mesh", str(folder / "other.stl")) == 2
    shown = capsys.readouterr()
    assert shown.err.count("\n") == 1
    assert "the cloud does not fit the mesh" in shown.err
    assert "what was scanned is in" in shown.err
    assert document(folder)["points"] > 1000


def test_a_part_out_of_reach_is_refused_before_anything_is_written(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "part.toml").write_text("[cell]\ntable_in_base = [2500, 0, 120, 0, 0, 0]\n" + PART)
    assert scan(folder, "part.toml") == 2
    shown = capsys.readouterr()
    assert shown.err.count("\n") == 1
    assert "nothing of the part can be reached" in shown.err
    assert not (folder / "out").exists()


@pytest.mark.parametrize("share", ["0", "1.01", "-1", "nan", "all"])
def test_a_share_beyond_what_can_be_seen_is_refused(
    share: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        scan(folder, "part.toml", "--adapt", share)
    assert ended.value.code == 2
    assert "allowed is a share above 0 and up to 1" in capsys.readouterr().err


@pytest.mark.parametrize("command", ["map", "plan"])
def test_a_scan_without_a_path_has_no_map_and_no_plan(
    command: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([command, str(folder / "part.toml"), "--out", str(folder / "out")]) == 2
    shown = capsys.readouterr()
    assert "path.pattern is adaptive: there is no predefined path" in shown.err
    assert shown.err.count("\n") == 1


def test_an_adaptive_scan_takes_no_other_key_of_a_path(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "part.toml").write_text(PART + "time_step_s = 0.5\n")
    assert scan(folder, "part.toml") == 2
    assert "path.time_step_s is not a known key; known are pattern" in capsys.readouterr().err


def test_the_same_scan_gives_the_same_bytes(folder: Path) -> None:
    results = []
    for _ in range(2):
        assert scan(folder, "part.toml", "--adapt", "0.1") == 0
        results.append([(folder / "out" / name).read_bytes() for name in ("cloud.ply", "scan.json", "poses.csv")])
    assert results[0] == results[1]


def test_after_ctrl_c_on_the_path_no_share_of_what_can_be_seen_is_claimed(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupted(_self: KnownPart) -> list[Strip]:
        raise KeyboardInterrupt

    monkeypatch.setattr(KnownPart, "next_strips", interrupted)
    assert scan(folder, "rings.toml", "--adapt", "0.9") == 1
    shown = capsys.readouterr().out
    assert "What can be seen was not computed" in shown
    assert "of what can be seen" not in shown
    found = document(folder)["adaptive"]
    assert (found["seen_of_visible"], found["visible_of_whole"]) == (None, None)
    assert found["unseen"][0]["can_be_seen_mm2"] is None
    assert found["seen_of_whole"] > 0.2


def test_ctrl_c_on_the_way_back_keeps_the_report(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(_self: TableCarrier, _solid: Obstacle) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(TableCarrier, "draw_back", interrupted)
    assert scan(folder, "part.toml", "--adapt", "0.1") == 1
    assert "It ended early: interrupted" in (folder / "out" / "report.html").read_text()


def test_strips_that_cannot_be_carried_out_are_no_success(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(table_carrier, "plan_strip", lambda *_: "a reason")
    assert scan(folder, "rings.toml", "--adapt", "0.95") == 1
    shown = capsys.readouterr().out
    assert "could not be carried out, and no others see what is left" in shown
    assert document(folder)["adaptive"]["seen_of_visible"] < 0.9


def test_a_table_that_fails_in_the_second_strip_ends_the_session_and_the_first_is_kept(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    run, runs = run_on_table, list[LatchedRun]()

    def failing(*arguments: Any) -> LatchedRun:  # noqa: ANN401 - passed on
        if runs:
            raise TableError("no reply within 500 ms")
        runs.append(run(*arguments))
        return runs[0]

    monkeypatch.setattr(table_carrier, "run_on_table", failing)
    assert scan(folder, "part.toml", "--adapt", "0.8") == 1
    assert "no reply within 500 ms" in capsys.readouterr().out
    found = document(folder)
    assert len(found["adaptive"]["strips"]) == 1
    assert found["adaptive"]["refused"] == []
    assert found["points"] > 1000


def test_the_same_part_in_other_triangles_has_the_same_share_of_what_can_be_seen(folder: Path) -> None:
    other = cup().subdivide()
    other.faces = np.random.default_rng(0).permutation(np.asarray(other.faces))
    other.export(folder / "other.stl")
    shares = []
    for more in ((), ("--mesh", str(folder / "other.stl"))):
        assert scan(folder, "part.toml", "--adapt", "0.5", *more) == 0
        found = document(folder)["adaptive"]
        shares.append((found["seen_of_visible"], found["visible_of_whole"]))
    assert shares[1] == pytest.approx(shares[0], abs=0.03)
