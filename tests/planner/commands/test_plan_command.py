import re
from pathlib import Path

import numpy as np
import pytest

import planner
from planner.__main__ import main
from planner.planning.planners import PLANNERS
from planner.plans.plan_file import load_plan

SMALL = ["--angles", "60", "--configuration", "LEFTY-ABOVE-NOFLIP"]


def test_a_shipped_scan_gives_a_plan_a_picture_and_a_report(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plan", "mould", *SMALL, "--out", str(tmp_path / "new")]) == 0
    assert sorted(file.name for file in (tmp_path / "new").iterdir()) == ["arm.png", "map.npz", "plan.json", "plan.png"]
    plan = load_plan(tmp_path / "new" / "plan.json").plan
    assert plan.configuration == "LEFTY-ABOVE-NOFLIP"
    assert np.abs(plan.speeds_deg_s).max() <= 40.0 + 1e-9
    out = capsys.readouterr().out
    assert f"cost          {plan.cost.total:.4f}" in out
    assert "margins" in out
    assert "follows within joint limits" in out


def test_the_best_configuration_is_the_cheapest_of_all_eight(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["plan", "mould", "--angles", "60", "--out", str(tmp_path)]) == 0
    told = capsys.readouterr().err.splitlines()
    assert len(told) == 8
    costs = {line.split()[0]: float(line.split()[-1]) for line in told if " cost " in line}
    plan = load_plan(tmp_path / "plan.json").plan
    assert plan.configuration == min(costs, key=lambda name: costs[name])
    assert plan.cost.total == pytest.approx(min(costs.values()), abs=1e-3)


def test_compare_has_a_line_for_each_planner_and_keeps_the_start(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["plan", "mould", *SMALL, "--start", "10", "--compare", "--out", str(tmp_path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    table = lines[next(i for i, line in enumerate(lines) if line.startswith("planner ")) + 1 :]
    assert [line.split()[0] for line in table] == list(PLANNERS)
    executable = [line for line in table if not line.startswith("local_maxima")]
    assert all(line.split()[2:4] == ["0", "yes"] for line in executable), table
    assert load_plan(tmp_path / "plan.json").plan.angles_deg[0] == 10.0


def test_smoothing_lowers_the_peaks_and_never_raises_the_cost(tmp_path: Path) -> None:
    rays = [*SMALL, "--planner", "ray_shooting"]
    assert main(["plan", "mould", *rays, "--out", str(tmp_path / "rough")]) == 0
    assert main(["plan", "mould", *rays, "--smooth", "--out", str(tmp_path / "smooth")]) == 0
    rough, smooth = (load_plan(tmp_path / name / "plan.json").plan for name in ("rough", "smooth"))
    assert smooth.planner == "ray_shooting+smoothing"
    assert np.sum(smooth.accelerations_deg_s2**4) < np.sum(rough.accelerations_deg_s2**4)  # led by the peaks
    assert smooth.cost.total <= rough.cost.total


def test_the_same_scan_gives_the_same_bytes(tmp_path: Path) -> None:
    for name in ("a", "b"):
        assert main(["plan", "mould", *SMALL, "--planner", "ray_shooting", "--out", str(tmp_path / name)]) == 0
    for file in (tmp_path / "a").iterdir():
        assert file.read_bytes() == (tmp_path / "b" / file.name).read_bytes()


def weighted(folder: Path, weights: str) -> str:
    """Return a scan file like the shipped mould with other weights; one that is not named keeps its default."""
    text = (Path(planner.__file__).parent / "scans" / "mould.toml").read_text()
    file = folder / "weighted.toml"
    file.write_text(re.sub(r"k_a = .*\nk_w = .*\n", f"{weights}\n", text, count=1))
    assert weights in file.read_text()
    return str(file)


@pytest.mark.parametrize("weights", ["k_a = 0.0", "k_w = 0.0", "k_a = 0.0\nk_w = 0.0"])
def test_a_weight_of_0_gives_a_map_and_a_plan(weights: str, tmp_path: Path) -> None:
    for command in ("map", "plan"):
        assert main([command, weighted(tmp_path, weights), *SMALL, "--out", str(tmp_path / command)]) == 0


@pytest.mark.parametrize("weights", ["k_a = -1e-9", "k_w = 1e305", "k_a = inf"])
def test_a_weight_that_cannot_be_is_refused_alike_by_map_and_plan(
    weights: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    refusals = []
    for command in ("map", "plan"):
        assert main([command, weighted(tmp_path, weights), *SMALL, "--out", str(tmp_path / command)]) == 2
        refusals.append(capsys.readouterr().err.partition(": ")[2])
    assert refusals[0] == refusals[1]
    assert len(refusals[0].splitlines()) == 1
    assert "weighted.toml" in refusals[0]


def test_where_there_is_no_plan_the_reason_is_told_with_status_1_and_no_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["--angles", "60", "--configuration", "RIGHTY-BELOW-FLIP", "--out", str(tmp_path / "out")]
    assert main(["plan", "mould", *arguments]) == 1
    shown = capsys.readouterr()
    assert "no plan" in shown.out
    assert "location 0" in shown.err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("arguments", [["nosuch"], ["mould", "--configuration", "SIDEWAYS"]])
def test_bad_input_is_one_sentence_and_status_2(
    arguments: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["plan", *arguments, "--out", str(tmp_path / "out")]) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert len(shown.err.splitlines()) == 1


@pytest.mark.parametrize(
    "option", [["--start", "north"], ["--start", "nan"], ["--planner", "magic"], ["--angles", "3"]]
)
def test_an_option_that_cannot_be_meant_is_refused(
    option: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as exit_status:
        main(["plan", "mould", *option, "--out", str(tmp_path)])
    assert exit_status.value.code == 2
    assert option[1] in capsys.readouterr().err
