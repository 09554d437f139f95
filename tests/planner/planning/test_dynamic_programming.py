import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.cell.scan import load_scan
from planner.kinematics.configuration import Configuration
from planner.map.config_map import ConfigurationMap
from planner.map.map_builder import build_maps
from planner.map.map_problem import map_problem
from planner.map.synthetic_maps import MapFamily, synthetic_map
from planner.planning.dynamic_programming import dynamic_programming
from planner.planning.interpolated_planner import interpolated_plan
from planner.planning.scan_problem import scan_problem
from planner.plans.plan import Infeasibility, NoPlan, Plan, make_plan, path_cost
from planner.plans.problem import Problem
from planner.search.lattice_choice import turn_lattice
from planner.search.lattice_search import best_motion
from planner.table.cost import Weights, default_weights
from planner.table.motion import Limits, motion_through_angles
from tests.planner.exhaustive_search import is_forbidden_on_the_way, least_cost, motion
from tools.bench.planner_families import (
    around_a_motion,
    fast_corridor,
    fast_fine_corridor,
    near_the_limit,
    of_gaps,
    of_noise,
)

SMALL = MapFamily(0.3, 4.0, location_count=25, angle_count=40)


def planned(problem: Problem) -> Plan:
    outcome = dynamic_programming(problem)
    assert isinstance(outcome, Plan), outcome
    return outcome


def lattice_cost(problem: Problem) -> float:
    """Return the cost of the best path of a lattice with 20 speeds in each direction; infinity if it has none."""
    lattice = turn_lattice(problem, 20, 10_000_000)
    assert lattice is not None
    best = best_motion(problem, lattice)
    return math.inf if best is None else make_plan(problem, "lattice", *best).cost.total


@pytest.mark.parametrize("forbidden", [0.25, 0.5])
@pytest.mark.parametrize("seed", range(8))
def test_on_a_tiny_map_the_verdict_and_the_cost_are_those_of_trying_every_motion(seed: int, forbidden: float) -> None:
    configuration_map = synthetic_map(MapFamily(forbidden, 1.2, location_count=5, angle_count=18), seed)
    start_deg = 20.0 * int(np.argmax(configuration_map.values[0]))
    problem = Problem(configuration_map, step_s=1.0, limits=Limits(40.0, 40.0), start_angle_deg=start_deg)
    optimum = least_cost(problem, [-40.0, -20.0, 0.0, 20.0, 40.0])
    outcome = dynamic_programming(problem)
    if isinstance(outcome, NoPlan):
        assert math.isinf(optimum)
        assert outcome.infeasibility is not Infeasibility.NOT_FOUND
    else:
        # Its accelerations are arbitrary, so it may cost less.
        assert outcome.cost.total <= optimum * 1.001
        assert not is_forbidden_on_the_way(problem.map, outcome)


@pytest.mark.parametrize("family", [of_noise(0.02), of_noise(0.1), near_the_limit, of_gaps(3)])
def test_a_plan_costs_what_the_best_path_of_a_fine_lattice_costs(family: Callable[[int], Problem]) -> None:
    ratios = []
    for seed in range(4):
        problem = family(seed)
        outcome, optimum = dynamic_programming(problem), lattice_cost(problem)
        if isinstance(outcome, NoPlan):
            assert math.isinf(optimum)
        elif optimum < math.inf:
            ratios.append(outcome.cost.total / optimum)
    assert len(ratios) >= 2
    assert np.mean(ratios) <= 1.001
    assert np.max(ratios) <= 1.015


@pytest.mark.parametrize("seed", range(1, 5))
@pytest.mark.parametrize("factor", [0.1, 1.0, 30.0])
def test_a_plan_costs_no_more_than_that_of_the_interpolated_cost_to_go(seed: int, factor: float) -> None:
    weights = Weights(*(weight * factor for weight in default_weights(Limits())))
    problem = Problem(synthetic_map(SMALL, seed), 0.25, weights=weights)
    interpolated = interpolated_plan(problem)
    assert interpolated is not None
    assert planned(problem).cost.total <= interpolated.cost.total


@pytest.mark.parametrize(
    "problem",
    [
        *(fast_corridor(seed) for seed in range(0, 42, 3)),
        *(fast_fine_corridor(seed) for seed in range(4)),
        *(of_gaps(width)(seed) for width, seed in ((1, 4), (1, 5), (2, 10), (3, 2))),
    ],
)
def test_what_a_grid_is_too_coarse_for_is_found(problem: Problem) -> None:
    assert not is_forbidden_on_the_way(problem.map, planned(problem))


@pytest.fixture(scope="module", params=[100, 90])
def cylinder(request: pytest.FixtureRequest) -> Problem:
    """The shipped scan at a number of angles, in the configuration of its best plan."""
    scan, configuration = load_scan("cylinder"), Configuration.LEFTY_ABOVE_NOFLIP
    return scan_problem(scan, build_maps(map_problem(scan), [configuration], request.param)[configuration], None)


@pytest.mark.parametrize("limit_deg_s", [22.5, 23.0, 23.5, 24.0, 25.0])
def test_the_shipped_cylinder_is_planned_for_a_table_hardly_fast_enough(cylinder: Problem, limit_deg_s: float) -> None:
    problem = replace(cylinder, limits=Limits(limit_deg_s, cylinder.limits.acceleration_deg_s2), weights=None)
    assert not is_forbidden_on_the_way(problem.map, planned(problem))


def test_the_shipped_cylinder_is_refused_with_a_proof_for_a_table_too_slow(cylinder: Problem) -> None:
    outcome = dynamic_programming(replace(cylinder, limits=Limits(20.0), weights=None))
    assert isinstance(outcome, NoPlan)
    assert outcome.infeasibility is Infeasibility.UNREACHABLE


@pytest.mark.parametrize("seed", range(40))
def test_where_a_motion_is_known_a_plan_is_found(seed: int) -> None:
    problem, _ = around_a_motion(seed)
    assert not is_forbidden_on_the_way(problem.map, planned(problem))


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("step_s", [0.1, 0.4])
def test_no_column_and_no_sub_step_is_ever_forbidden(seed: int, step_s: float) -> None:
    problem = Problem(synthetic_map(SMALL, seed), step_s=step_s)
    outcome = dynamic_programming(problem)
    if isinstance(outcome, Plan):
        assert not is_forbidden_on_the_way(problem.map, outcome)
        assert outcome.pauses == ()


@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 1000),
    step_s=st.floats(0.05, 1.0),
    speed_limit=st.floats(5.0, 60.0),
    acceleration_limit=st.floats(5.0, 200.0),
    start_share=st.floats(-1.0, 1.0),
    start_deg=st.none() | st.floats(-1000.0, 1000.0),
)
def test_limits_equations_and_the_reported_cost_always_hold(
    seed: int,
    step_s: float,
    speed_limit: float,
    acceleration_limit: float,
    start_share: float,
    start_deg: float | None,
) -> None:
    problem = Problem(
        synthetic_map(MapFamily(0.2, 4.0, location_count=20, angle_count=36), seed),
        step_s=step_s,
        limits=Limits(speed_limit, acceleration_limit),
        start_angle_deg=start_deg,
        start_speed_deg_s=start_share * speed_limit,
    )
    plan = dynamic_programming(problem)
    if isinstance(plan, NoPlan):
        return
    assert np.abs(plan.speeds_deg_s).max() <= speed_limit * (1 + 1e-9)
    assert np.abs(plan.accelerations_deg_s2).max() <= acceleration_limit * (1 + 1e-9)
    assert not is_forbidden_on_the_way(problem.map, plan)
    start = float(plan.angles_deg[0]), float(plan.speeds_deg_s[0])
    assert start[1] == start_share * speed_limit
    assert start_deg is None or start[0] == start_deg
    states = np.array(motion(start, plan.accelerations_deg_s2.tolist(), step_s))
    assert plan.angles_deg == pytest.approx(states[:, 0], abs=1e-9)
    assert plan.speeds_deg_s == pytest.approx(states[:, 1], abs=1e-9)
    speeds, accelerations = motion_through_angles(plan.angles_deg, start[1], step_s)
    assert path_cost(problem, plan.angles_deg, speeds, accelerations).total == pytest.approx(plan.cost.total, rel=1e-6)


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 1000), shift=st.integers(0, 39), turns=st.integers(-3, 3))
def test_turning_the_map_turns_the_plan(seed: int, shift: int, turns: int) -> None:
    original = synthetic_map(SMALL, seed)
    start = int(np.argmax(original.values[0])) * original.angle_step_deg
    moved = shift * original.angle_step_deg + 360.0 * turns
    turned = ConfigurationMap(np.roll(original.values, shift, axis=1))
    plan = dynamic_programming(Problem(original, 0.3, start_angle_deg=start))
    other = dynamic_programming(Problem(turned, 0.3, start_angle_deg=start + moved))
    assert type(plan) is type(other)
    if isinstance(plan, Plan) and isinstance(other, Plan):
        assert other.cost.total == pytest.approx(plan.cost.total, rel=1e-4)


def sign_changes(plan: Plan) -> int:
    """Count how often the acceleration changes its sign, ignoring values below a hundredth of the limit."""
    accelerations = plan.accelerations_deg_s2[np.abs(plan.accelerations_deg_s2) > 1.0]
    return int(np.count_nonzero(np.diff(np.sign(accelerations))))


def test_a_plan_is_smooth_by_itself() -> None:
    # A bright oscillating band: the table has to follow it smoothly.
    columns, samples = np.arange(80), np.arange(360)
    middle = 180.0 + 30.0 * np.sin(columns / 25.0)
    values = np.exp(-(((samples[None, :] - middle[:, None]) / 50.0) ** 2))
    problem = Problem(ConfigurationMap(values), 0.5)
    interpolated = interpolated_plan(problem)
    assert interpolated is not None
    assert sign_changes(planned(problem)) <= 6 < sign_changes(interpolated)


def test_a_given_start_is_kept() -> None:
    problem = Problem(synthetic_map(SMALL._replace(forbidden=0.0), 1), start_angle_deg=-777.7, start_speed_deg_s=-3.21)
    plan = planned(problem)
    assert (plan.angles_deg[0], plan.speeds_deg_s[0]) == (-777.7, -3.21)


def test_a_free_start_costs_no_more_than_any_given_one() -> None:
    configuration_map = synthetic_map(SMALL._replace(forbidden=0.1), 2)
    free = planned(Problem(configuration_map, start_speed_deg_s=None)).cost.total
    at_rest = planned(Problem(configuration_map)).cost.total
    given_starts = [
        outcome.cost.total
        for angle in configuration_map.angles_deg
        if isinstance(outcome := dynamic_programming(Problem(configuration_map, start_angle_deg=float(angle))), Plan)
    ]
    assert at_rest <= min(given_starts) * 1.001
    assert free <= at_rest * 1.001


def test_a_corridor_that_drifts_faster_than_the_table_turns_is_unreachable_and_says_where() -> None:
    values = np.zeros((20, 60))
    for k in range(20):
        center = 5 if k < 10 else 5 + 3 * (k - 9)
        values[k, [(center + offset) % 60 for offset in range(-3, 4)]] = 1.0
    outcome = dynamic_programming(Problem(ConfigurationMap(values), step_s=0.1))
    assert isinstance(outcome, NoPlan)
    assert outcome.infeasibility is Infeasibility.UNREACHABLE
    assert outcome.location is not None
    assert 10 <= outcome.location <= 14
    assert isinstance(dynamic_programming(Problem(ConfigurationMap(values[: outcome.location]), step_s=0.1)), Plan)


def test_a_long_map_without_a_way_is_a_result() -> None:
    values = np.ones((400, 360))
    values[300, :180], values[301, 180:] = 0.0, 0.0
    outcome = dynamic_programming(Problem(ConfigurationMap(values), step_s=0.1))
    assert isinstance(outcome, NoPlan)
    assert (outcome.infeasibility, outcome.location) == (Infeasibility.UNREACHABLE, 301)


def test_a_map_of_1200_locations_and_1440_angles_is_planned() -> None:
    family = MapFamily(0.2, 8.0, location_count=1200, angle_count=1440)
    plan = planned(Problem(synthetic_map(family, 1), 0.25))
    assert plan.pauses == ()


def test_a_slow_table_for_which_every_lattice_is_too_large_is_planned() -> None:
    # It gains 0.025 deg/s in a step, so that a lattice would need nodes every thousandth of a degree.
    problem = Problem(synthetic_map(SMALL._replace(forbidden=0.1), 1), step_s=0.05, limits=Limits(40.0, 0.5))
    assert not is_forbidden_on_the_way(problem.map, planned(problem))


def test_a_corridor_one_sample_wide_is_followed() -> None:
    values = np.zeros((15, 12))
    values[:, 7] = 0.4
    plan = planned(Problem(ConfigurationMap(values)))
    assert plan.angles_deg == pytest.approx(np.full(15, 210.0))


@pytest.mark.parametrize("start_speed_deg_s", [0.0, 15.0])
def test_a_gap_of_one_sample_is_passed_from_a_start_off_the_samples(start_speed_deg_s: float) -> None:
    values = np.ones((20, 36))
    values[10] = 0.0
    values[10, 7] = 1.0
    problem = Problem(ConfigurationMap(values), 0.25, start_angle_deg=41.7, start_speed_deg_s=start_speed_deg_s)
    plan = planned(problem)
    assert plan.angles_deg[10] == pytest.approx(70.0)
    assert not is_forbidden_on_the_way(problem.map, plan)


@pytest.mark.parametrize(("step_s", "forbidden", "seed"), [(0.1, 0.3, 7), (0.25, 0.4, 7), (0.4, 0.6, 3), (0.1, 0.6, 2)])
def test_where_the_interpolated_cost_to_go_finds_no_way_a_plan_is_found(
    step_s: float, forbidden: float, seed: int
) -> None:
    family = MapFamily(forbidden, 2.0, location_count=25, angle_count=40)
    problem = Problem(synthetic_map(family, seed), step_s=step_s)
    assert interpolated_plan(problem) is None
    assert not is_forbidden_on_the_way(problem.map, planned(problem))


@pytest.mark.parametrize("scale", [1e-30, 1e30, 1e200])
def test_extreme_weights_still_give_a_plan(scale: float) -> None:
    problem = Problem(synthetic_map(SMALL, 1), step_s=0.3, weights=Weights(scale, scale))
    plan = planned(problem)
    assert math.isfinite(plan.cost.total)
    assert not is_forbidden_on_the_way(problem.map, plan)


@pytest.mark.parametrize("weights", [Weights(0.0, 1e-4), Weights(1e-5, 0.0), Weights(0.0, 0.0)])
def test_a_weight_of_0_gives_a_plan(weights: Weights) -> None:
    problem = Problem(synthetic_map(SMALL, 1), step_s=0.3, weights=weights)
    plan = planned(problem)
    assert not is_forbidden_on_the_way(problem.map, plan)
    assert (plan.cost.acceleration == 0.0) == (weights.acceleration == 0.0)
    assert (plan.cost.speed == 0.0) == (weights.speed == 0.0)


def test_a_path_of_two_locations_is_planned() -> None:
    plan = planned(Problem(ConfigurationMap(np.array([[1.0] * 8, [0.5] * 8]))))
    assert plan.cost.total == pytest.approx(0.5)


def test_a_blocked_location_is_named() -> None:
    values = np.ones((6, 8))
    values[4] = 0.0
    outcome = dynamic_programming(Problem(ConfigurationMap(values)))
    assert isinstance(outcome, NoPlan)
    assert (outcome.infeasibility, outcome.location) == (Infeasibility.BLOCKED_LOCATION, 4)
