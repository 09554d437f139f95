"""Scans that the arm can follow only when the table takes part of the probe's roll, from the plan to the run."""

import csv
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import emulator  # noqa: F401 - teaches pyserial the port emulator://
from planner.__main__ import main
from planner.arrays import FloatArray
from tests.planner.arm_scans import hasty_scan, hopeless_scan, winding_scan

QUICK = ["--angles", "90", "--configuration", "LEFTY-ABOVE-NOFLIP"]


def plan_in(folder: Path) -> dict[str, Any]:
    document: dict[str, Any] = json.loads((folder / "plan.json").read_text(encoding="utf-8"))
    return document


def robot_path(folder: Path) -> tuple[FloatArray, FloatArray]:
    """Return times (n,) and joints (n, 6) in degrees of `robot.csv`."""
    with (folder / "robot.csv").open(encoding="utf-8", newline="") as lines:
        rows = list(csv.DictReader(lines))
    times_s = np.array([float(row["time_s"]) for row in rows])
    return times_s, np.array([[float(row[f"joint_{j}_deg"]) for j in range(1, 7)] for row in rows])


@pytest.mark.parametrize("write_scan", [winding_scan, hasty_scan])
def test_the_arm_scans_are_planned_run_and_scanned(
    write_scan: Callable[[Path], Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scan = str(write_scan(tmp_path))
    assert main(["plan", scan, *QUICK, "--out", str(tmp_path / "plan")]) == 0
    assert "follows within joint limits and joint speeds" in capsys.readouterr().out
    plan_file = str(tmp_path / "plan" / "plan.json")
    assert main(["run", plan_file, "--port", "emulator://", "--out", str(tmp_path / "run")]) == 0
    arm = plan_in(tmp_path / "plan")["arm"]
    times_s, joints_deg = robot_path(tmp_path / "run")
    assert len(times_s) == len(plan_in(tmp_path / "plan")["joints_deg"])
    assert (joints_deg >= arm["lower_deg"]).all()
    assert (joints_deg <= arm["upper_deg"]).all()
    speeds_deg_s = np.abs(np.diff(joints_deg, axis=0)) / np.diff(times_s)[:, np.newaxis]
    assert (speeds_deg_s <= np.array(arm["max_speed_deg_s"]) * (1.0 + 1e-9)).all()
    assert main(["scan", scan, *QUICK, "--rate", "5", "--out", str(tmp_path / "scan")]) == 0


def test_start_turns_and_margins_are_in_the_plan_and_in_the_report(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["plan", str(winding_scan(tmp_path)), *QUICK, "--out", str(tmp_path / "plan")]) == 0
    document, out = plan_in(tmp_path / "plan"), capsys.readouterr().out
    joints_deg, arm = np.array(document["joints_deg"]), document["arm"]
    # Joint 6 uses both of its turns, and its middle is at 0: it starts a turn away from there.
    assert document["start_turns"] == [0, 0, 0, 0, 0, int(np.sign(joints_deg[0, 5]))]
    assert abs(joints_deg[0, 5]) > 180.0
    limits_deg = np.minimum(joints_deg - arm["lower_deg"], arm["upper_deg"] - joints_deg).min(axis=0)
    assert document["margins"]["joint_limits_deg"] == pytest.approx(limits_deg, abs=1e-6)
    speeds_deg_s = arm["max_speed_deg_s"] - np.abs(np.diff(joints_deg, axis=0)).max(axis=0) / document["step_s"]
    assert document["margins"]["joint_speeds_deg_s"] == pytest.approx(speeds_deg_s, abs=1e-6)
    assert 4.9 <= limits_deg[5] <= 20.0
    assert f"joint 6 at {joints_deg[0, 5]:.1f} deg (turn {document['start_turns'][5]:+d})" in out
    assert "".join(f"{margin:9.1f}" for margin in limits_deg) in out


@pytest.mark.parametrize("command", ["plan", "scan"])
def test_a_scan_without_a_way_names_the_joint_and_the_first_location(
    command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    # Joint 6 turns by 76 - 20 deg and then by 76 - 40 deg a location: 704 deg after 19, of 720.
    scan = str(hopeless_scan(tmp_path))
    status = main([command, scan, *QUICK, "--out", str(tmp_path / "out")])
    shown = capsys.readouterr()
    assert status == {"plan": 1, "scan": 2}[command]
    assert "(joint 6 limit, location 20)" in shown.out + shown.err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("planner", ["ray_shooting", "rotate_when_blocked"])
def test_a_planner_that_looks_at_the_table_alone_says_where_the_arm_cannot_follow(
    planner: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["--planner", planner, "--out", str(tmp_path / "plan")]
    assert main(["plan", str(winding_scan(tmp_path)), *QUICK, *arguments]) == 1
    assert "cannot follow at location" in capsys.readouterr().out
    plan_file = str(tmp_path / "plan" / "plan.json")
    assert main(["run", plan_file, "--port", "emulator://", "--out", str(tmp_path / "run")]) == 2
    assert "joint 6" in capsys.readouterr().err


def test_all_planners_are_compared_by_what_the_arm_can_follow_too(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = [*QUICK, "--compare", "--smooth", "--out", str(tmp_path / "plan")]
    assert main(["plan", str(winding_scan(tmp_path)), *arguments]) == 0
    lines = capsys.readouterr().out.splitlines()
    verdicts = {line.split()[0]: line for line in lines[next(i for i, x in enumerate(lines) if x.endswith("arm")) :]}
    assert verdicts["dynamic_programming"].endswith(" follows")
    assert verdicts["ray_shooting"].endswith("cannot follow")
