import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.errors import ScanFileError
from planner.kinematics.arm import Arm
from planner.kinematics.configuration import Configuration
from planner.kinematics.joint_configurations import configurations
from planner.kinematics.value import (
    FACTORS,
    UserFactor,
    ValueFunction,
    clearance_factor,
    joint_factor,
    joint_ranges,
    joints_value,
    wrist_factor,
)
from protocol.files.toml_table import TomlTable

DEFAULT = ValueFunction()


def test_eq_1_is_one_in_the_middle_and_zero_at_both_ends_exactly() -> None:
    assert joint_factor(0.5, -1.0, 2.0, 0.2) == 1.0
    assert joint_factor(-1.0, -1.0, 2.0, 0.2) == 0.0
    assert joint_factor(2.0, -1.0, 2.0, 0.2) == 0.0
    assert joint_factor(2.1, -1.0, 2.0, 0.2) == 0.0


@settings(deadline=None)
@given(share=st.floats(1e-6, 1 - 1e-6), gamma=st.floats(0.05, 5.0))
def test_eq_1_is_the_sine_as_printed(share: float, gamma: float) -> None:
    assert joint_factor(-2.0 + 5.0 * share, -2.0, 3.0, gamma) == pytest.approx(
        math.sin(math.pi * share) ** gamma, rel=1e-6
    )


def test_eq_2_with_gamma_1_has_the_mean_of_a_product_of_sines() -> None:
    ranges = np.array([[[-1.0, 2.0]] * 6])
    table = replace(DEFAULT, gamma=(1.0,) * 6).table
    rng = np.random.default_rng(0)
    values = [joints_value(table, joints, ranges, 0)[0] for joints in rng.uniform(-1.0, 2.0, (20_000, 1, 6))]
    assert np.mean(values) == pytest.approx((2 / math.pi) ** 6, rel=0.05)


def test_the_joint_nearest_its_limit_is_named() -> None:
    ranges = np.array([[[-1.0, 1.0]] * 6])
    joints = np.array([[0.0, 0.2, -0.9, 0.3, 0.1, 0.0]])
    assert joints_value(DEFAULT.table, joints, ranges, 0)[2] == 2


def test_a_joint_factor_that_is_off_does_not_count() -> None:
    ranges = np.array([[[-1.0, 1.0]] * 6])
    joints = np.array([[0.0, 0.0, 0.9, 0.0, 0.0, 0.5]])
    alone = DEFAULT.only(["joint_6"])
    assert joints_value(alone.table, joints, ranges, 0)[0] == joint_factor(0.5, -1.0, 1.0, 0.2)


def test_each_configuration_has_its_own_half_of_joints_3_and_5() -> None:
    ranges = np.degrees(joint_ranges(Arm.load()))
    flip, noflip = Configuration.LEFTY_ABOVE_FLIP, Configuration.LEFTY_ABOVE_NOFLIP
    assert ranges[flip, 4] == pytest.approx([-120, 0])
    assert ranges[noflip, 4] == pytest.approx([0, 120])
    assert ranges[flip, 2] == pytest.approx([106.966, 256], abs=1e-3)
    assert ranges[Configuration.LEFTY_BELOW_FLIP, 2] == pytest.approx([-29, 106.966], abs=1e-3)
    assert ranges[Configuration.RIGHTY_BELOW_FLIP, 2] == pytest.approx([106.966, 256], abs=1e-3)
    assert (ranges[:, 0] == ranges[flip, 0]).all()


@pytest.mark.parametrize("mirrored", [False, True])
def test_joints_lie_within_the_range_of_the_configuration_that_they_are_in(mirrored: bool) -> None:
    arm = Arm.load()
    if mirrored:
        arm = replace(
            arm,
            alpha_deg=tuple(-alpha for alpha in arm.alpha_deg),
            lower_deg=tuple(-upper for upper in arm.upper_deg),
            upper_deg=tuple(-lower for lower in arm.lower_deg),
        )
    rng = np.random.default_rng(0)
    joints = rng.uniform(np.radians(arm.lower_deg), np.radians(arm.upper_deg), (2000, 6))
    ranges = joint_ranges(arm)[configurations(arm, joints)]
    assert ((ranges[..., 0] <= joints) & (joints <= ranges[..., 1])).all()


def test_the_wrist_is_forbidden_up_to_its_threshold_and_fine_from_the_comfortable_angle_on() -> None:
    table = DEFAULT.table
    assert wrist_factor(table, math.radians(5.0)) == 0.0
    assert wrist_factor(table, math.radians(-5.0)) == 0.0
    assert wrist_factor(table, math.radians(-12.5)) == pytest.approx(0.5)
    assert wrist_factor(table, math.radians(20.0)) == 1.0


@settings(deadline=None)
@given(
    near_mm=st.floats(-200, 200),
    more_mm=st.floats(0, 100),
    weight=st.floats(0.1, 5.0),
)
def test_more_clearance_never_lowers_the_value(near_mm: float, more_mm: float, weight: float) -> None:
    table = replace(DEFAULT, clearance_weight=weight).table
    near, far = clearance_factor(table, near_mm), clearance_factor(table, near_mm + more_mm)
    assert 0.0 <= near <= far <= 1.0
    assert (near == 0.0) == (near_mm <= DEFAULT.minimum_clearance_mm)


def test_a_factor_can_be_looked_at_on_its_own() -> None:
    mine = UserFactor("mine", lambda poses: np.ones(len(poses.joints)))
    value_function = replace(DEFAULT, user_factors=(mine,))
    assert value_function.only(["wrist"]).factors == {"wrist"}
    assert value_function.only(["wrist"]).user_factors == ()
    assert value_function.only(["mine"]).user_factors == (mine,)
    assert value_function.only(["mine"]).factors == frozenset()
    with pytest.raises(ValueError, match="'elbow' is not a factor"):
        value_function.only(["elbow"])


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: replace(DEFAULT, factors=frozenset({"elbow"})),
        lambda: replace(DEFAULT, gamma=(0.2,) * 5),
        lambda: replace(DEFAULT, gamma=(-1.0,) * 6),
        lambda: replace(DEFAULT, wrist_weight=-1.0),
        lambda: replace(DEFAULT, wrist_threshold_deg=30.0),
        lambda: replace(DEFAULT, minimum_clearance_mm=30.0),
        lambda: replace(DEFAULT, minimum_clearance_mm=float("nan")),
    ],
)
def test_a_value_function_that_cannot_be_meant_is_refused(wrong: Callable[[], ValueFunction]) -> None:
    with pytest.raises(ValueError, match=r"factor|exponents|wrist|clearance"):
        wrong()


def table(text: str, tmp_path: Path) -> TomlTable:
    file = tmp_path / "scan.toml"
    file.write_text(text)
    return TomlTable.load(file, ScanFileError)


def test_an_empty_table_gives_the_defaults(tmp_path: Path) -> None:
    assert ValueFunction.read(table("", tmp_path)) == DEFAULT


def test_a_table_switches_and_weighs_factors(tmp_path: Path) -> None:
    read = ValueFunction.read(table('wrist = "off"\nclearance_weight = 2\ngamma = [1, 1, 1, 1, 1, 1]', tmp_path))
    assert read.factors == set(FACTORS) - {"wrist"}
    assert read.exponents == (1, 1, 1, 1, 1, 1, 1, 2)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("gamma = [0.2, 0.2, 0.2, 0.2, 0.2, -1]", "at least 0"),
        ("elbow = 1", "not a known key"),
        ("wrist_threshold_deg = 40", "up to 40 deg"),
        ("comfortable_clearance_mm = 1", "up to 5 mm"),
        ('joint_3 = "maybe"', "one of on, off"),
    ],
)
def test_a_table_with_a_wrong_value_is_refused_by_file_and_key(text: str, told: str, tmp_path: Path) -> None:
    with pytest.raises(ScanFileError, match=told) as refusal:
        ValueFunction.read(table(text, tmp_path))
    assert "scan.toml" in str(refusal.value)
