"""Plans that `run` refuses before anything moves, from the command line, on an emulator whose position is read."""

import json
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from planner.__main__ import main
from planner.kinematics.configuration import Configuration
from planner.kinematics.inverse_kinematics import inverse_kinematics
from protocol import TableClient
from protocol.control_channel import ControlChannel
from tests.planner.run_examples import CELL, JOINTS_DEG, LOCATIONS, scan_locations, write_short_scan

Document = dict[str, Any]
Change = Callable[[Document], object]


@pytest.fixture(scope="module")
def start_emulator(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[str, Path]]:
    """Yield the port and the control channel of a running emulator."""
    control = tmp_path_factory.mktemp("emulator") / "control"
    command = [sys.executable, "-m", "emulator", "--tcp", "0", "--control", str(control)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
        assert process.stdout is not None
        try:
            yield process.stdout.readline().strip(), control
        finally:
            process.terminate()


def state_of(control: Path) -> tuple[float, float, float]:
    """Return the true position of the table."""
    status = ControlChannel(control).status()
    return status.reference_deg, status.encoder_deg, status.true_deg


def with_joints(joints_deg: np.ndarray[Any, np.dtype[np.float64]]) -> Change:
    """Return the change that gives a plan other joints, and the probe's poses that belong to them."""

    def change(document: Document) -> None:
        angles_deg = np.array(document["table"]["angles_deg"])
        document["joints_deg"] = joints_deg.tolist()
        document["locations"] = scan_locations(angles_deg, joints_deg).tolist()

    return change


def moved(joint: int, by_deg: float, first: int = 0, last: int = LOCATIONS) -> Change:
    """Return the change that moves one joint, counted from 1, at some locations."""
    joints_deg = JOINTS_DEG.copy()
    joints_deg[first:last, joint - 1] += by_deg
    return with_joints(joints_deg)


def flip_the_wrist(document: Document) -> None:
    """Put the same poses into another configuration than the plan's."""
    joints, _ = inverse_kinematics(CELL.arm, CELL.arm.flange_poses(np.radians(JOINTS_DEG)))
    document["joints_deg"] = np.degrees(np.unwrap(joints[:, Configuration.LEFTY_ABOVE_FLIP], axis=0)).tolist()


def call_a_step_a_pause(document: Document) -> None:
    moved(6, 300.0, first=8)(document)
    document["table"]["pauses"] = [{"step": 7, "from_angle_deg": 0.0, "to_angle_deg": 0.0}]


REFUSED: dict[str, tuple[Change, str]] = {
    "joint 6 a turn too far": (moved(6, 720.0), "at location 0 joint 6 is at 720.0 deg, beyond its limit of 360 deg"),
    "joint 4 a turn too far": (
        moved(4, -360.0),
        "at location 0 joint 4 is at -360.0 deg, beyond its limit of -190 deg",
    ),
    "joint 2 beyond its limit": (
        moved(2, 110.0, 5),
        "at location 5 joint 2 is at 50.0 deg, beyond its limit of 45 deg",
    ),
    "joint 1 beyond its limit": (
        with_joints(JOINTS_DEG + np.array([120.0, 0.0, 0.0, 0.0, 0.0, 0.0])),
        "at location 13 joint 1 is at 172.0 deg, beyond its limit of 170 deg",
    ),
    "joint 6 in a step": (moved(6, 61.0, 4), "at location 4 joint 6 moves at 610.0 deg/s from the previous location"),
    "joint 1 back in a step": (
        moved(1, -37.0, 7),
        "at location 7 joint 1 moves at -330.0 deg/s from the previous location",
    ),
    "a turn that is not carried along": (moved(6, 360.0, 9), "at location 9 joint 6 moves by 360.0 deg from the"),
    "joints that are lies": (
        lambda plan: plan["joints_deg"][3].__setitem__(0, 12.01),
        "at location 3 its joints put the probe 0.0",
    ),
    "a turned probe": (lambda plan: plan["joints_deg"][3].__setitem__(5, 0.01), "at location 3 its joints put the"),
    "a table elsewhere": (lambda plan: plan["cell"]["T_BT"][0].__setitem__(3, 600.0), "at location 0 its joints put"),
    "another configuration": (flip_the_wrist, "at location 0 the joints are not in LEFTY-ABOVE-NOFLIP"),
    "no joints at a location": (lambda plan: plan["joints_deg"].__setitem__(2, [None] * 6), "joint 1 has no angle"),
    "the planner's own word": (
        lambda plan: plan.update(arm_fault="OUT_OF_REACH at location 5"),
        "the arm cannot follow the plan: OUT_OF_REACH at location 5",
    ),
    "limits that were lifted": (
        lambda plan: (moved(6, 720.0)(plan), plan["arm"]["upper_deg"].__setitem__(5, 3600.0)),
        "its arm is not the arm of its map",
    ),
    "a pause that hides a jump": (call_a_step_a_pause, "has been edited: the pause in step 7 contradicts the angles"),
    "an earlier version's plan": (
        lambda plan: plan.pop("arm"),
        "create the plan again: python -m planner plan short --out",
    ),
    "an arm that is none": (lambda plan: plan["arm"]["d_mm"].pop(), "must hold 6 finite numbers"),
    "a pose that is none": (
        lambda plan: plan["locations"][8][1].__setitem__(3, None),
        "at location 8 there is no pose of the probe",
    ),
    "a number that is none": (
        lambda plan: plan["cell"]["T_BT"][0].__setitem__(3, 10**400),
        "is damaged: OverflowError",
    ),
    "an angle that is none": (
        lambda plan: plan["table"]["angles_deg"].__setitem__(0, 10**400),
        "is damaged: OverflowError",
    ),
    "a limit that is missing": (lambda plan: plan["limits"].pop("speed_deg_s"), "is damaged: KeyError, 'speed_deg_s'"),
    "no poses": (lambda plan: plan.pop("locations"), "is damaged: KeyError, 'locations'"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_an_arm_that_cannot_follow_is_refused_in_one_line_and_nothing_moves(
    case: str, start_emulator: tuple[str, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    change, sentence = REFUSED[case]
    plan_file = write_short_scan(tmp_path)
    document = json.loads(plan_file.read_text(encoding="utf-8"))
    change(document)
    plan_file.write_text(json.dumps(document), encoding="utf-8")
    port, control = start_emulator
    before = state_of(control)
    arguments = ["--port", port, "--control", str(control), "--out", str(tmp_path / "run")]
    assert main(["run", str(plan_file), *arguments]) == 2
    shown = capsys.readouterr()
    assert sentence in shown.err
    assert shown.err.startswith(f"planner run: {plan_file}")
    assert shown.err.count("\n") == 1
    assert shown.out == ""
    assert not (tmp_path / "run").exists()
    assert state_of(control) == before


def test_the_example_that_the_refusals_change_is_a_plan_that_runs(tmp_path: Path) -> None:
    plan_file = write_short_scan(tmp_path)
    assert main(["run", str(plan_file), "--port", "emulator://", "--out", str(tmp_path / "run")]) == 0
    document = json.loads(plan_file.read_text(encoding="utf-8"))
    cost = document["cost"]
    moved(6, -359.0)(document)
    document["cost"] = {"acceleration": -1.0, "speed": "low", "value": None, "pauses": 1e9, "total": 0.0}
    plan_file.write_text(json.dumps(document), encoding="utf-8")
    assert main(["run", str(plan_file), "--port", "emulator://", "--out", str(tmp_path / "run")]) == 0
    assert json.loads((tmp_path / "run" / "run.json").read_text(encoding="utf-8"))["cost"]["planned"] == cost


def test_a_table_that_turns_already_is_not_moved(
    start_emulator: tuple[str, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    port, control = start_emulator
    plan_file = write_short_scan(tmp_path)
    with TableClient.open(port) as table:
        table.set_speed(20.0)
        table.move_by(1000.0)
        table.clock.sleep_s(0.5)
    try:
        arguments = ["--port", port, "--control", str(control), "--out", str(tmp_path / "run"), "--arm-away"]
        assert main(["run", str(plan_file), *arguments]) == 2
        said = capsys.readouterr().err
        assert "deg and is already turning; wait until it stands" in said
        assert said.count("\n") == 1
        assert names_in(tmp_path / "run") == set()
    finally:
        with TableClient.open(port) as table:
            table.set_acceleration(100.0)
            table.stop()


def names_in(folder: Path) -> set[str]:
    return {file.name for file in folder.iterdir() if file.is_file()}


RUN_FILES = {"run.json", "run.csv", "run.png", "robot.csv", "robot.json", "plan.json", "map.npz", "report.html"}


@pytest.mark.parametrize(
    "refused",
    [
        ["--port", "/dev/no-such-device"],
        ["--port", "loop://", "--timeout", "0.05"],
        ["--port", "emulator://", "--baud", "600"],
        ["--port", "emulator://", "--map", "no-such-map"],
    ],
    ids=["no port", "no table", "slow line", "no map"],
)
def test_a_refused_run_leaves_no_results_and_loses_none(refused: list[str], tmp_path: Path) -> None:
    plan_file, out = write_short_scan(tmp_path), tmp_path / "run"
    assert main(["run", str(plan_file), "--port", "emulator://", "--out", str(out)]) == 0
    former = (out / "run.json").read_bytes()
    assert main(["show", str(out)]) == 0
    assert main(["run", str(plan_file), *refused, "--out", str(out)]) == 2
    assert names_in(out) == set()
    assert names_in(out / "previous") == RUN_FILES
    assert (out / "previous" / "run.json").read_bytes() == former
    assert main(["show", str(out)]) == 2
    assert main(["show", str(out / "previous")]) == 0


def test_a_run_into_the_folder_of_its_plan_keeps_the_plan(tmp_path: Path) -> None:
    plan_file = write_short_scan(tmp_path)
    before = plan_file.read_bytes()
    for port, status in (("emulator://", 0), ("/dev/no-such-device", 2), ("emulator://", 0)):
        assert main(["run", str(plan_file), "--port", port, "--out", str(tmp_path)]) == status
        assert plan_file.read_bytes() == before
        assert (tmp_path / "run.json").exists() == (status == 0)


def test_a_plan_that_fails_leaves_no_plan_and_no_run_of_another(tmp_path: Path) -> None:
    plan_file = write_short_scan(tmp_path)
    assert main(["run", str(plan_file), "--port", "emulator://", "--out", str(tmp_path)]) == 0
    assert main(["plan", "no-such-scan", "--out", str(tmp_path)]) == 2
    assert names_in(tmp_path) == set()
    assert names_in(tmp_path / "previous") == RUN_FILES


@pytest.mark.parametrize(
    ("command", "names"),
    [("scan", ["cloud.ply", "cloud.xyz", "poses.csv", "scan.json", "report.html"]), ("map", ["map.npz", "map.png"])],
)
def test_a_scan_or_map_that_fails_leaves_none_of_another(command: str, names: list[str], tmp_path: Path) -> None:
    for name in names:
        (tmp_path / name).write_text("former")
    assert main([command, "no-such-scan", "--out", str(tmp_path)]) == 2
    assert names_in(tmp_path) == set()
    assert names_in(tmp_path / "previous") == set(names)


def test_a_control_channel_on_which_nobody_answers_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    plan_file, control = write_short_scan(tmp_path), tmp_path / "none"
    words = ["--port", "emulator://", "--control", str(control), "--out", str(tmp_path / "run")]
    assert main(["run", str(plan_file), *words]) == 2
    said = capsys.readouterr().err.splitlines()[-1]
    assert said.startswith(f"planner run: {control}: ")
    assert "--control socket" in said
    assert names_in(tmp_path / "run") == set()
