import json
from pathlib import Path

import numpy as np
import pytest

from planner.cell.scan import Scan, load_scan
from planner.kinematics.configuration import Configuration
from planner.map.config_map import ConfigurationMap
from planner.plans.arm_motion import arm_motion
from planner.plans.arm_on_path import arm_on_path
from planner.plans.plan import Pause, Plan, make_plan
from planner.plans.plan_file import PlanFileError, load_plan, plan_document, save_plan
from planner.plans.problem import Problem

CONFIGURATION = Configuration.parse("LEFTY-ABOVE-NOFLIP")


@pytest.fixture(scope="module")
def scan() -> Scan:
    return load_scan("mould")


def still_plan(scan: Scan, pauses: tuple[Pause, ...] = ()) -> tuple[Problem, Plan]:
    """Return a plan in which the table does not move, except in its pauses."""
    count = scan.path.count
    problem = Problem(ConfigurationMap(np.ones((count, 8)), metadata={"configuration": CONFIGURATION.label}))
    angles = np.zeros(count)
    for pause in pauses:
        angles[pause.step + 1 :] = pause.to_angle_deg
    return problem, make_plan(problem, "still", angles, np.zeros(count), np.zeros(count - 1), pauses)


def test_a_plan_comes_back_as_it_was(scan: Scan, tmp_path: Path) -> None:
    problem, plan = still_plan(scan, (Pause(3, 0.0, 90.0),))
    save_plan(
        tmp_path / "plan.json", plan_document(scan, problem, plan, arm_motion(arm_on_path(scan, CONFIGURATION), plan))
    )
    stored = load_plan(tmp_path / "plan.json")
    loaded = stored.plan
    for name in ("angles_deg", "speeds_deg_s", "accelerations_deg_s2"):
        assert np.array_equal(getattr(loaded, name), getattr(plan, name))
    assert (loaded.planner, loaded.configuration, loaded.step_s) == ("still", CONFIGURATION.label, plan.step_s)
    assert (loaded.cost, loaded.pauses) == (plan.cost, plan.pauses)
    assert (stored.scan, stored.limits) == (scan.name, problem.limits)
    assert stored.arm_fault == "out of reach at location 4"  # the table does not move
    np.testing.assert_allclose(stored.arm.T_WS, scan.path.T_WS, atol=1e-8)
    assert stored.arm.cell.arm == scan.cell.arm
    assert [file.name for file in tmp_path.iterdir()] == ["plan.json"]


def test_the_file_holds_what_running_it_needs(scan: Scan) -> None:
    problem, plan = still_plan(scan)
    document = plan_document(scan, problem, plan, arm_motion(arm_on_path(scan, CONFIGURATION), plan))
    assert np.array(document["joints_deg"]).shape == (scan.path.count, 6)
    assert np.array(document["locations"]) == pytest.approx(scan.path.T_WS, abs=1e-8)
    assert np.array(document["cell"]["T_BT"]) == pytest.approx(scan.cell.T_BT)
    assert document["limits"] == {"speed_deg_s": 40.0, "acceleration_deg_s2": 100.0}
    assert document["provenance"]["scan"] == "mould"
    assert document["cost"]["total"] == plan.cost.total
    json.dumps(document, allow_nan=False)


@pytest.mark.parametrize("text", ["", "{}", "[1]", '{"format": "seventh-axis plan", "format_version": 99}'])
def test_a_file_that_is_no_plan_is_refused_by_name(text: str, tmp_path: Path) -> None:
    file = tmp_path / "odd.json"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(PlanFileError, match=r"odd\.json"):
        load_plan(file)


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(PlanFileError, match="cannot be read"):
        load_plan(tmp_path / "none.json")


def test_a_damaged_plan_is_refused(scan: Scan, tmp_path: Path) -> None:
    problem, plan = still_plan(scan)
    document = plan_document(scan, problem, plan, arm_motion(arm_on_path(scan, CONFIGURATION), plan))
    document["table"]["angles_deg"].pop()
    save_plan(tmp_path / "plan.json", document)
    with pytest.raises(PlanFileError, match="damaged"):
        load_plan(tmp_path / "plan.json")
