"""Planners and value factors of other packages: found by name, checked, and without effect on others when broken."""

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import planner
from planner.__main__ import main
from planner.plug_ins import FACTOR_GROUP, PLANNER_GROUP, PlugInError, load_plug_in, plug_in_names

QUICK = ["--angles", "60", "--configuration", "LEFTY-ABOVE-NOFLIP"]
MODULE = """
import dataclasses
import numpy as np
from planner.plans.plan import NoPlan
from planner.planning.rotate_when_blocked import rotate_when_blocked

def good(problem):
    return rotate_when_blocked(problem)

def failing(problem):
    return 1 / 0

def nothing(problem):
    return None

def short(problem):
    plan = rotate_when_blocked(problem)
    return dataclasses.replace(plan, angles_deg=plan.angles_deg[1:])

def infinite(problem):
    plan = rotate_when_blocked(problem)
    return dataclasses.replace(plan, speeds_deg_s=np.full_like(plan.speeds_deg_s, np.inf))

def lying(problem):
    plan = rotate_when_blocked(problem)
    return dataclasses.replace(plan, angles_deg=plan.angles_deg + np.arange(len(plan.angles_deg)) ** 2, pauses=())

def pausing(problem):
    plan = rotate_when_blocked(problem)
    return dataclasses.replace(plan, pauses=("later",))

def exiting(problem):
    raise SystemExit(4)

def vague(problem):
    return NoPlan("?", "because")

def with_texts(problem):
    plan = rotate_when_blocked(problem)
    return dataclasses.replace(plan, angles_deg=["a"] * len(plan.angles_deg))

number = 7

def half(poses):
    return np.full(len(poses.joints), 0.5)

def north(poses):
    return (np.cos(np.radians(poses.table_angles_deg)) > 0.0).astype(float)

def scalar(poses):
    return 0.5

def large(poses):
    return np.full(len(poses.joints), 2.0)

def raising(poses):
    raise KeyError("color")
"""
PLANNERS = {
    "mine": "own_things:good",
    "failing": "own_things:failing",
    "nothing": "own_things:nothing",
    "short": "own_things:short",
    "infinite": "own_things:infinite",
    "lying": "own_things:lying",
    "pausing": "own_things:pausing",
    "exiting": "own_things:exiting",
    "vague": "own_things:vague",
    "texts": "own_things:with_texts",
    "number": "own_things:number",
    "absent": "own_things:absent",
    "no_module": "there_is_none:plan",
    "leaving": "own_things_that_leave:plan",
    "dijkstra": "own_things:nothing",
}
FACTORS = {name: f"own_things:{name}" for name in ("half", "north", "scalar", "large", "raising", "number")}
BROKEN = {
    "failing": "planner 'failing': failed: ZeroDivisionError: division by zero",
    "nothing": "planner 'nothing': returned None; it must return a Plan or a NoPlan",
    "short": "planner 'short': returned no valid Plan: angles_deg has shape (94,); it must be (95,)",
    "infinite": "planner 'infinite': returned no valid Plan: speeds_deg_s holds a value that is not a finite number",
    "lying": "planner 'lying': returned no valid Plan: angle, speed and acceleration of step 0 contradict one another",
    "pausing": "planner 'pausing': returned no valid Plan: AttributeError",
    "exiting": "planner 'exiting': failed: SystemExit: 4",
    "vague": "planner 'vague': returned no valid NoPlan: ValueError: 'because' is not a valid Infeasibility",
    "texts": "planner 'texts': returned no valid Plan: ValueError",
    "number": "planner 'number': is a value of type int; it must be a function from a Problem to a Plan",
    "absent": "planner 'absent': cannot be loaded from own-things (own_things:absent): AttributeError",
    "no_module": "planner 'no_module': cannot be loaded from own-things (there_is_none:plan): ModuleNotFoundError",
    "leaving": "planner 'leaving': cannot be loaded from own-things (own_things_that_leave:plan): SystemExit: 3",
}


def install(folder: Path, package: str, groups: dict[str, dict[str, str]]) -> None:
    """Make a package with that name known, like an installer."""
    metadata = folder / f"{package.replace('-', '_')}-1.0.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n", encoding="utf-8")
    lines = [
        f"[{group}]\n" + "".join(f"{name} = {value}\n" for name, value in each.items())
        for group, each in groups.items()
    ]
    (metadata / "entry_points.txt").write_text("\n".join(lines), encoding="utf-8")


@pytest.fixture(autouse=True)
def _own_things(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "site"
    folder.mkdir()
    (folder / "own_things.py").write_text(MODULE, encoding="utf-8")
    (folder / "own_things_that_leave.py").write_text("import sys\nsys.exit(3)\n", encoding="utf-8")
    install(folder, "own-things", {PLANNER_GROUP: PLANNERS, FACTOR_GROUP: FACTORS})
    monkeypatch.syspath_prepend(folder)
    monkeypatch.delitem(sys.modules, "own_things", raising=False)


def scan_with(folder: Path, value: str) -> str:
    file = folder / "scan.toml"
    text = (Path(planner.__file__).parent / "scans" / "cylinder.toml").read_text(encoding="utf-8")
    file.write_text(text.replace("[value]", f"[value]\n{value}"), encoding="utf-8")
    return str(file)


def test_the_plug_ins_are_listed_without_being_imported() -> None:
    assert plug_in_names(PLANNER_GROUP) == sorted(PLANNERS)
    assert plug_in_names(FACTOR_GROUP) == sorted(FACTORS)
    assert "own_things" not in sys.modules


def test_a_planner_of_another_package_plans_on_the_command_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    main(["plan", "cylinder", *QUICK, "--planner", "mine", "--out", str(tmp_path / "out")])
    assert capsys.readouterr().out.startswith("cylinder: mine, LEFTY-ABOVE-NOFLIP, 95 locations")
    assert '"planner": "mine"' in (tmp_path / "out" / "plan.json").read_text(encoding="utf-8")


def test_a_comparison_has_a_line_for_each_plug_in_and_none_breaks_the_others(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["plan", "cylinder", *QUICK, "--compare", "--out", str(tmp_path / "out")]) == 0
    lines = {line[:20].strip(): line for line in capsys.readouterr().out.splitlines()}
    assert "follows" in lines["dynamic_programming"]
    for name, message in BROKEN.items():
        assert lines[name][21:].startswith(message)
    mine, shipped = (lines[name].split()[1:4] for name in ("mine", "rotate_when_blocked"))
    assert mine == shipped
    assert "Dijkstra" not in lines
    assert "returned None" not in lines["dijkstra"]  # a plug-in does not take the name of a shipped planner


@pytest.mark.parametrize("name", BROKEN)
def test_a_broken_planner_is_refused_by_name_in_one_line(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["plan", "cylinder", *QUICK, "--planner", name, "--out", str(tmp_path / "out")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"planner plan: {BROKEN[name]}")
    assert not (tmp_path / "out").exists()


def test_an_unknown_planner_is_refused_with_those_that_there_are(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ending:
        main(["plan", "cylinder", "--planner", "mien", "--out", "out"])
    assert ending.value.code == 2
    shown = capsys.readouterr().err
    assert "is mien; allowed are dynamic_programming, receding," in shown
    assert "; did you mean mine?" in shown


def test_two_packages_with_one_name_are_both_named(tmp_path: Path) -> None:
    install(tmp_path / "site", "other-things", {PLANNER_GROUP: {"mine": "elsewhere:plan"}})
    with pytest.raises(PlugInError, match=r"'mine': other-things .* and own-things .* both provide this name"):
        load_plug_in(PLANNER_GROUP, "mine")


def test_a_factor_of_another_package_counts_in_the_map_when_the_scan_names_it(tmp_path: Path) -> None:
    slot = planner.Configuration.LEFTY_ABOVE_NOFLIP
    plain, halved = (
        planner.build_maps(planner.load_scan(name), [slot], 60)[slot]
        for name in ("cylinder", scan_with(tmp_path, 'user_factors = ["half"]'))
    )
    np.testing.assert_allclose(halved.values, 0.5 * plain.values)
    north = planner.build_maps(planner.load_scan(scan_with(tmp_path, 'user_factors = ["north"]')), [slot], 60)[slot]
    assert not north.allowed[:, 16:45].any()
    reasons = north.metadata["reasons"]
    assert isinstance(reasons, dict)
    assert north.reasons is not None
    assert {reasons[int(code)] for code in north.reasons[plain.allowed & ~north.allowed]} == {"excluded by north"}


@pytest.mark.parametrize(
    ("names", "message"),
    [
        ('["scalar"]', "factor 'scalar': returned an array of shape (); it must be ("),
        ('["large"]', "factor 'large': returned a value outside 0 to 1"),
        ('["raising"]', "factor 'raising': failed: KeyError: 'color'"),
        ('["number"]', "factor 'number': is not a function"),
        (
            '["haf"]',
            "factor 'haf': not found; allowed are half, large, north, number, raising, scalar; did you mean",
        ),
        ('["half", "half"]', "value.user_factors is ['half', 'half']; it must be a list of different names"),
        ('"half"', "value.user_factors is 'half'; it must be a list of texts"),
    ],
)
def test_a_factor_that_cannot_count_is_refused_by_name_in_one_line(
    names: str, message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scan = scan_with(tmp_path, f"user_factors = {names}")
    assert main(["map", scan, *QUICK, "--out", str(tmp_path / "out")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert message in line


def test_a_planner_by_api_is_checked_as_well() -> None:
    scan = planner.load_scan("cylinder")
    broken: Callable[[planner.Problem], planner.Plan] = lambda _problem: None  # type: ignore[assignment, return-value]  # noqa: E731  # broken deliberately
    with pytest.raises(PlugInError, match="returned None; it must return a Plan or a NoPlan"):
        planner.plan(scan, broken, "LEFTY-ABOVE-NOFLIP", 60)
