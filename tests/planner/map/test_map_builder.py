import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from planner.cell.pose_clearance import clearances
from planner.cell.scan import load_scan
from planner.geometry.transforms import rotations_z
from planner.kinematics.configuration import Configuration
from planner.kinematics.inverse_kinematics import inverse_kinematics
from planner.kinematics.value import FACTORS, RatedPoses, UserFactor, ValueFunction
from planner.map.config_map import DEFAULT_EPSILON, ConfigurationMap, ConfigurationMapError
from planner.map.map_builder import build_maps
from planner.map.map_problem import MapProblem, map_problem
from planner.map.map_reasons import FIRST_PAIR, FIRST_USER_FACTOR
from planner.reasons import Reason
from tests.planner.goals import goal_flange_poses

Array = NDArray[np.float64]

ALL = list(Configuration)
RANGES_OF_JOINT_5 = {True: (-120.0, 0.0), False: (0.0, 120.0)}
STRETCHED_DEG = 106.966


def problem(name: str, count: int) -> MapProblem:
    """Return a shipped scan's problem, reduced to a few locations."""
    whole = map_problem(load_scan(name))
    chosen = np.linspace(0, len(whole.T_WS) - 1, count).round().astype(int)
    return replace(whole, T_WS=whole.T_WS[chosen])


@cache
def cylinder(count: int = 24) -> MapProblem:
    return problem("cylinder", count)


@cache
def mould(count: int = 24) -> MapProblem:
    return problem("mould", count)


def slow_cell(problem: MapProblem, location: int, angle_deg: float, slot: Configuration) -> tuple[float, int]:
    """Return f_R and the reason of one cell, step by step as in the paper's section 3."""
    cell, value = problem.cell, problem.value
    goal = goal_flange_poses(cell, problem.T_WS[[location]], np.array([angle_deg]))[0]
    joints, reasons = inverse_kinematics(cell.arm, goal)
    joints, reason = joints[0, slot], int(reasons[0, slot])
    if reason != Reason.REACHED:
        return 0.0, reason
    factors = []
    for j, angle in enumerate(np.degrees(joints)):
        lower, upper = cell.arm.lower_deg[j], cell.arm.upper_deg[j]
        if j == 2 and slot.above == slot.lefty:
            lower = STRETCHED_DEG
        elif j == 2:
            upper = STRETCHED_DEG
        elif j == 4:
            lower, upper = RANGES_OF_JOINT_5[slot.flip]
        factors.append(math.sin(math.pi * (angle - lower) / (upper - lower)) ** value.gamma[j])
    f_R = math.prod(factors)
    joint_5 = abs(math.degrees(joints[4]))
    wrist = (joint_5 - value.wrist_threshold_deg) / (value.wrist_comfortable_deg - value.wrist_threshold_deg)
    f_R *= min(max(wrist, 0.0), 1.0) ** value.wrist_weight
    if f_R <= DEFAULT_EPSILON:
        worst = int(np.argmin(factors))
        return 0.0, Reason.SINGULAR if wrist <= factors[worst] else Reason.JOINT_1_LIMIT + worst
    model = problem.collision
    common = model._replace(pairs=model.pairs[: model.n_common])
    at_angle = cell.arm, joints[None], np.array([angle_deg]), cell.probe.stand_off_mm
    nearest = clearances(common, *at_angle)
    if nearest.clearance_mm[0] > value.minimum_clearance_mm:
        nearest = clearances(model, *at_angle)
    clearance = (nearest.clearance_mm[0] - value.minimum_clearance_mm) / (
        value.comfortable_clearance_mm - value.minimum_clearance_mm
    )
    f_R *= min(max(clearance, 0.0), 1.0) ** value.clearance_weight
    return (0.0, FIRST_PAIR + int(nearest.pair[0])) if f_R <= DEFAULT_EPSILON else (f_R, Reason.REACHED)


@pytest.mark.parametrize("scene", [cylinder, mould])
def test_the_map_is_what_the_paper_says_cell_by_cell(scene: Callable[[int], MapProblem]) -> None:
    n_angles, posed = 18, scene(12)
    maps = build_maps(posed, ALL, n_angles)
    seen = set()
    for slot in ALL:
        for location in range(12):
            for i in range(n_angles):
                value, reason = slow_cell(posed, location, 360.0 * i / n_angles, slot)
                # The clearance of a housing is accurate to two thousandths of a mm.
                assert maps[slot].values[location, i] == pytest.approx(value, abs=1e-4)
                assert reasons_of(maps[slot])[location, i] == reason
                seen.add(reason)
    assert len(seen) > 4


def reasons_of(configuration_map: ConfigurationMap) -> NDArray[np.uint8]:
    assert configuration_map.reasons is not None
    return configuration_map.reasons


@settings(deadline=None, max_examples=15)
@given(
    gamma=st.floats(0.05, 3.0),
    off=st.sets(st.sampled_from(FACTORS)),
    minimum_mm=st.floats(0.0, 29.0),
    weight=st.floats(0.2, 5.0),
)
def test_values_are_in_0_to_1_and_a_cell_is_0_exactly_where_a_reason_is_recorded(
    gamma: float, off: set[str], minimum_mm: float, weight: float
) -> None:
    value = replace(
        ValueFunction(),
        factors=frozenset(FACTORS) - off,
        gamma=(gamma,) * 6,
        minimum_clearance_mm=minimum_mm,
        clearance_weight=weight,
    )
    for configuration_map in build_maps(replace(cylinder(), value=value), ALL, 30).values():
        assert ((configuration_map.values >= 0.0) & (configuration_map.values <= 1.0)).all()
        forbidden = reasons_of(configuration_map) != Reason.REACHED
        assert np.array_equal(configuration_map.values == 0.0, forbidden)
        assert np.array_equal(configuration_map.allowed, ~forbidden)


@settings(deadline=None, max_examples=10)
@given(steps=st.integers(-36, 36))
def test_rotating_the_workpiece_about_the_table_axis_shifts_the_map(steps: int) -> None:
    n_angles, posed = 36, cylinder()
    turn = rotations_z(np.array([10.0 * steps]))[0]
    cell = replace(posed.cell, T_TW=turn @ posed.cell.T_TW)
    poses = posed.collision.poses.copy()
    poses[-1] = turn @ poses[-1]
    turned = replace(posed, cell=cell, collision=posed.collision._replace(poses=poses))
    before = build_maps(posed, ALL, n_angles)
    after = build_maps(turned, ALL, n_angles)
    for slot in ALL:
        assert after[slot].values == pytest.approx(np.roll(before[slot].values, -steps, axis=1), abs=1e-6)


def test_one_configuration_is_the_same_alone_as_with_all_others() -> None:
    together = build_maps(mould(), ALL, 40)
    for slot in ALL:
        alone = build_maps(mould(), [slot], 40)[slot]
        assert np.array_equal(alone.values, together[slot].values)
        assert np.array_equal(reasons_of(alone), reasons_of(together[slot]))


def test_more_clearance_wanted_never_raises_a_value() -> None:
    near = build_maps(cylinder(), ALL, 60)
    far = build_maps(replace(cylinder(), value=replace(ValueFunction(), comfortable_clearance_mm=60.0)), ALL, 60)
    lower = [(far[slot].values < near[slot].values).sum() for slot in ALL]
    assert all((far[slot].values <= near[slot].values).all() for slot in ALL)
    assert sum(lower) > 0


def test_a_single_factor_gives_its_own_map_and_all_multiply_to_the_whole() -> None:
    slot = Configuration.LEFTY_ABOVE_NOFLIP
    posed = cylinder()
    whole = build_maps(posed, [slot], 36)[slot]
    product = np.ones_like(whole.values)
    for name in FACTORS:
        product *= build_maps(replace(posed, value=posed.value.only([name])), [slot], 36)[slot].values
    assert whole.values[whole.allowed] == pytest.approx(product[whole.allowed])


def test_a_users_factor_multiplies_into_the_map_and_may_forbid() -> None:
    slot, posed = Configuration.LEFTY_ABOVE_NOFLIP, cylinder()
    seen: list[RatedPoses] = []

    def late_is_worse(poses: RatedPoses) -> Array:
        seen.append(poses)
        return np.where(poses.locations >= 20, 0.0, 1.0 - poses.table_angles_deg / 720.0)

    plain = build_maps(posed, [slot], 36)[slot]
    value = replace(posed.value, user_factors=(UserFactor("late is worse", late_is_worse),))
    rated = build_maps(replace(posed, value=value), [slot], 36)[slot]
    expected = plain.values * (1.0 - rated.angles_deg / 720.0)
    expected[20:] = 0.0
    assert rated.values == pytest.approx(expected)
    late = reasons_of(rated)[20:][plain.allowed[20:]]
    assert len(late) > 0
    assert (late == FIRST_USER_FACTOR).all()
    texts = rated.metadata["reasons"]
    assert isinstance(texts, dict)
    assert texts[FIRST_USER_FACTOR] == "excluded by late is worse"
    assert sum(len(poses.joints) for poses in seen) == plain.allowed.sum()
    assert max(poses.clearance_mm.max() for poses in seen) <= posed.value.comfortable_clearance_mm


def test_more_cells_than_memory_can_hold_are_refused_before_the_map_is_begun() -> None:
    done: list[tuple[int, int]] = []
    with pytest.raises(ConfigurationMapError, match="57,600,000 cells; at most 50,000,000 are allowed; use fewer ang"):
        build_maps(cylinder(12), ALL, 600_000, lambda *now: done.append(now))
    assert done == []


@pytest.mark.parametrize("wrong", [2.0, -0.1, float("nan")])
def test_a_users_factor_outside_0_to_1_is_refused_by_its_name(wrong: float) -> None:
    factor = UserFactor("mine", lambda poses: np.full(len(poses.joints), wrong))
    value = replace(ValueFunction(), user_factors=(factor,))
    with pytest.raises(ValueError, match="'mine'"):
        build_maps(replace(cylinder(), value=value), [Configuration.LEFTY_ABOVE_NOFLIP], 36)


def test_progress_is_told_between_blocks_and_may_end_the_work() -> None:
    done: list[tuple[int, int]] = []
    build_maps(cylinder(), [Configuration.LEFTY_ABOVE_NOFLIP], 8192, lambda *now: done.append(now))
    assert done == [(2 * block, 24) for block in range(13)]

    def interrupt(_done: int, _all: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        build_maps(cylinder(), ALL, 36, interrupt)


def test_an_arm_whose_angles_are_counted_in_another_way_has_the_same_map() -> None:
    posed = cylinder(6)
    arm = posed.cell.arm
    sign, offset_deg = (-1.0, 1.0, -1.0, 1.0, -1.0, -1.0), (0.0, 90.0, -180.0, 0.0, 0.0, 20.0)
    lower, upper = np.sort((np.degrees(arm.limits) - offset_deg) * np.array(sign), axis=0)
    own = replace(arm, sign=sign, offset_deg=offset_deg, lower_deg=tuple(lower), upper_deg=tuple(upper))
    seen: list[RatedPoses] = []

    def look(poses: RatedPoses) -> Array:
        seen.append(poses)
        return np.ones(len(poses.joints))

    value = replace(posed.value, user_factors=(UserFactor("look", look),))
    slot = Configuration.LEFTY_ABOVE_NOFLIP
    maps = [
        build_maps(replace(posed, cell=replace(posed.cell, arm=each), value=value), [slot], 24)[slot]
        for each in (arm, own)
    ]
    np.testing.assert_allclose(maps[0].values, maps[1].values, atol=1e-9)
    np.testing.assert_array_equal(maps[0].reasons, maps[1].reasons)
    plain, counted = (np.degrees(poses.joints) for poses in seen)
    np.testing.assert_allclose(plain, counted * sign + offset_deg, atol=1e-9)
