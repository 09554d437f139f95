"""The content of `import planner`: little at first, and everything by name."""

import subprocess
import sys
from dataclasses import FrozenInstanceError
from pathlib import Path

import pytest

import planner


def test_the_public_names_are_few_sorted_and_there() -> None:
    assert planner.__all__ == sorted(planner.__all__, key=lambda name: (name[0].islower(), name))
    assert len(planner.__all__) < 25
    for name in planner.__all__:
        assert getattr(planner, name).__module__.startswith("planner.")
        assert name in dir(planner)
    with pytest.raises(AttributeError, match="has no attribute 'plna'"):
        planner.plna  # noqa: B018  # misspelled deliberately


def test_importing_the_planner_loads_nothing_that_takes_long() -> None:
    program = "import sys, planner; print(*({'numpy', 'numba', 'scipy', 'trimesh', 'matplotlib'} & sys.modules.keys()))"
    result = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == ""


def test_a_plan_is_one_value_that_cannot_change_and_can_be_saved_and_run(tmp_path: Path) -> None:
    planned = planner.plan(planner.load_scan("cylinder"), configuration="LEFTY-ABOVE-NOFLIP", angle_count=60)
    assert isinstance(planned, planner.PlannedScan)
    assert planned.is_executable
    with pytest.raises(FrozenInstanceError):
        planned.plan = planned.plan  # type: ignore[misc]  # that is the point
    options = planner.RunOptions("elsewhere", arm_is_away=True)
    finished = planner.run(planned.save(tmp_path / "plan"), "emulator://", tmp_path / "run", options)
    assert finished.checked.is_verified
    assert "<h1>Run of cylinder</h1>" in (tmp_path / "run" / "report.html").read_text(encoding="utf-8")
    assert (tmp_path / "run" / "plan.json").read_bytes() == (tmp_path / "plan" / "plan.json").read_bytes()


def test_where_there_is_no_plan_the_answer_says_why(tmp_path: Path) -> None:
    text = (Path(planner.__file__).parent / "scans" / "cylinder.toml").read_text(encoding="utf-8")
    (tmp_path / "scan.toml").write_text(text.replace("[570, 0, 120,", "[1500, 0, 120,"), encoding="utf-8")
    answer = planner.plan(planner.load_scan(tmp_path / "scan.toml"), configuration="LEFTY-ABOVE-NOFLIP", angle_count=60)
    assert isinstance(answer, planner.NoPlan)
    assert answer.infeasibility is planner.Infeasibility.BLOCKED_LOCATION


def test_factors_are_added_to_those_of_the_scan() -> None:
    scan = planner.load_scan("cylinder")
    one = planner.UserFactor("one", lambda poses: poses.clearance_mm * 0.0 + 1.0)
    assert planner.with_factors(planner.with_factors(scan, one), one).value.user_factors == (one, one)
