"""Required properties of every shipped arm."""

import re
from pathlib import Path

import numpy as np
import pytest

from planner.kinematics.arm import Arm
from planner.kinematics.inverse_kinematics import inverse_kinematics
from planner.reasons import Reason

ROOT = Path(__file__).parents[3]
ARMS = sorted(file.stem for file in (ROOT / "planner" / "arms").glob("*.toml"))


@pytest.mark.parametrize("name", ARMS)
def test_an_arm_finds_joints_for_each_of_its_own_poses(name: str) -> None:
    arm = Arm.load(name)
    lower, upper = arm.limits
    joints = np.random.default_rng(1).uniform(lower, upper, (2000, 6))
    poses = arm.flange_poses(joints)
    found, reasons = inverse_kinematics(arm, poses)
    reached = reasons == Reason.REACHED
    assert reached.any(axis=1).all()
    wanted = np.broadcast_to(poses[:, np.newaxis], (*reached.shape, 4, 4))[reached]
    assert np.abs(arm.flange_poses(found[reached]) - wanted).max() < 1e-6


@pytest.mark.parametrize("name", ARMS)
def test_an_arm_is_named_in_the_docs_and_its_figures_have_a_source(name: str) -> None:
    assert re.search(rf"\b{name}\b", (ROOT / "docs" / "map.md").read_text(encoding="utf-8"))
    assert (ROOT / "planner" / "arms" / f"{name}.toml").read_text(encoding="utf-8").startswith("# ")
