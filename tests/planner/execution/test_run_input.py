"""Plan files that must not be executed: each is refused with one sentence that names the file."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from planner.errors import PlannerError
from planner.execution.run_input import load_run_input
from tests.planner.run_examples import LOCATIONS, short_run_input, write_short_scan


def test_a_plan_comes_back_with_its_map_and_its_limits(tmp_path: Path) -> None:
    run_input = load_run_input(write_short_scan(tmp_path))
    written = short_run_input()
    np.testing.assert_array_equal(run_input.plan.angles_deg, written.plan.angles_deg)
    np.testing.assert_array_equal(run_input.problem.map.values, written.problem.map.values)
    assert run_input.problem.limits == written.problem.limits
    assert run_input.joints_deg.shape == (LOCATIONS, 6)


def test_full_turns_move_the_whole_plan(tmp_path: Path) -> None:
    run_input = load_run_input(write_short_scan(tmp_path))
    turned = run_input.turned(-2)
    np.testing.assert_allclose(turned.plan.angles_deg, run_input.plan.angles_deg - 720.0)
    np.testing.assert_array_equal(turned.plan.speeds_deg_s, run_input.plan.speeds_deg_s)


def edit(plan_file: Path, change: Callable[[dict[str, Any]], object]) -> None:
    document = json.loads(plan_file.read_text(encoding="utf-8"))
    change(document)
    plan_file.write_text(json.dumps(document), encoding="utf-8")


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda plan: plan["table"]["angles_deg"].__setitem__(5, 1.0), "has been edited: .* of step"),
        (lambda plan: plan["table"]["speeds_deg_s"].__setitem__(5, 1.0), "has been edited: .* of step"),
        (lambda plan: plan["limits"].update(speed_deg_s=1.0), "exceeds its own limits"),
        (lambda plan: plan.pop("joints_deg"), "is damaged: KeyError, 'joints_deg'"),
        (lambda plan: plan["joints_deg"].pop(), "is damaged: the plan does not have the 16 locations"),
        (lambda plan: plan["provenance"]["map"].update(digest="other"), "is not the map of "),
        (lambda plan: plan["table"]["angles_deg"].__setitem__(5, float("nan")), "NaN is not a number"),
    ],
)
def test_an_edited_plan_is_refused(tmp_path: Path, change: Callable[[dict[str, Any]], object], sentence: str) -> None:
    plan_file = write_short_scan(tmp_path)
    edit(plan_file, change)
    with pytest.raises(PlannerError, match=sentence):
        load_run_input(plan_file)


def test_a_plan_cut_short_is_refused(tmp_path: Path) -> None:
    plan_file = write_short_scan(tmp_path)
    plan_file.write_bytes(plan_file.read_bytes()[:500])
    with pytest.raises(PlannerError, match=str(plan_file)):
        load_run_input(plan_file)


def test_a_plan_whose_map_now_forbids_it_is_refused(tmp_path: Path) -> None:
    plan_file = write_short_scan(tmp_path)

    def stand_still(plan: dict[str, Any]) -> None:
        plan["table"].update(
            angles_deg=[0.0] * LOCATIONS, speeds_deg_s=[0.0] * LOCATIONS, accelerations_deg_s2=[0.0] * (LOCATIONS - 1)
        )

    edit(plan_file, stand_still)
    with pytest.raises(PlannerError, match="meets a forbidden region in step 5"):
        load_run_input(plan_file)


def test_a_missing_map_is_named_with_the_command_that_writes_it(tmp_path: Path) -> None:
    plan_file = write_short_scan(tmp_path)
    (tmp_path / "map.npz").unlink()
    with pytest.raises(PlannerError, match="python -m planner map short --out"):
        load_run_input(plan_file)
