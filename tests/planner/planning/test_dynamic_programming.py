import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.map.config_map import ConfigurationMap
from planner.map.synthetic_maps import MapFamily, synthetic_map
from planner.planning.cost_to_go import cost_to_go
from planner.planning.dynamic_programming import MOST_FINE_STATES, dynamic_programming, fine_grids, follow
from planner.planning.plan import Infeasibility, NoPlan, Plan, path_cost
from planner.planning.problem import Problem
from planner.planning.state_grid import default_grid, exact_grid
from planner.table.cost import Weights
from planner.table.motion import Limits, motion_through_angles
from tests.planner.exhaustive_search import is_forbidden_on_the_way, least_cost, motion

SMALL = MapFamily(0.3, 4.0, location_count=25, angle_count=40)


def planned(problem: Problem) -> Plan:
    outcome = dynamic_programming(problem)
    assert isinstance(outcome, Plan), outcome
    return outcome


@pytest.mark.parametrize("seed", range(6))
def test_on_a_tiny_lattice_it_finds_what_trying_every_motion_finds(seed: int) -> None:
    configuration_map = synthetic_map(MapFamily(0.25, 1.2, location_count=5, angle_count=18), seed)
    start_deg = 20.0 * int(np.argmax(configuration_map.values[0]))
    problem = Problem(configuration_map, step_s=1.0, limits=Limits(40.0, 40.0), start_angle_deg=start_deg)
    optimum = least_cost(problem, [-40.0, 0.0, 40.0])
    plan = dynamic_programming(problem, exact_grid(problem, refinement=1))
    if math.isinf(optimum):
        assert isinstance(plan, NoPlan)
    else:
        assert isinstance(plan, Plan)
        assert plan.cost.total == pytest.approx(optimum)


@pytest.mark.parametrize(
    "family",
    [
        MapFamily(0.1, 5.0, location_count=60, angle_count=60),
        MapFamily(0.4, 4.0, location_count=60, angle_count=60),
        MapFamily(0.4, 6.0, 0.7, location_count=60, angle_count=60),
        MapFamily(0.15, 2.0, location_count=60, angle_count=60),
    ],
)
def test_it_stays_within_a_hundredth_of_the_optimum_of_a_fine_exact_lattice(family: MapFamily) -> None:
    ratios = []
    for seed in range(5):
        problem = Problem(synthetic_map(family, seed), step_s=0.25)
        optimum = follow(problem, cost_to_go(problem, exact_grid(problem, refinement=16, jump_count=101)))
        if optimum is not None:
            ratios.append(planned(problem).cost.total / optimum.cost.total)
    assert len(ratios) >= 3
    assert np.mean(ratios) <= 1.01


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
)
def test_limits_equations_and_the_reported_cost_always_hold(
    seed: int, step_s: float, speed_limit: float, acceleration_limit: float, start_share: float
) -> None:
    problem = Problem(
        synthetic_map(MapFamily(0.2, 4.0, location_count=20, angle_count=36), seed),
        step_s=step_s,
        limits=Limits(speed_limit, acceleration_limit),
        start_speed_deg_s=start_share * speed_limit,
    )
    plan = dynamic_programming(problem)
    if isinstance(plan, NoPlan):
        return
    assert np.abs(plan.speeds_deg_s).max() <= speed_limit * (1 + 1e-9)
    assert np.abs(plan.accelerations_deg_s2).max() <= acceleration_limit * (1 + 1e-12)
    start = float(plan.angles_deg[0]), float(plan.speeds_deg_s[0])
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
        assert other.angles_deg == pytest.approx(plan.angles_deg + moved, abs=1e-6)
        assert other.cost.total == pytest.approx(plan.cost.total)


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
        centre = 5 if k < 10 else 5 + 3 * (k - 9)
        values[k, [(centre + offset) % 60 for offset in range(-3, 4)]] = 1.0
    outcome = dynamic_programming(Problem(ConfigurationMap(values), step_s=0.1))
    assert isinstance(outcome, NoPlan)
    assert outcome.infeasibility is Infeasibility.UNREACHABLE
    assert outcome.location is not None
    assert 10 <= outcome.location <= 14
    assert isinstance(dynamic_programming(Problem(ConfigurationMap(values[: outcome.location]), step_s=0.1)), Plan)


def test_a_long_map_without_a_way_is_a_result_and_takes_no_second_grid_beyond_its_memory() -> None:
    values = np.ones((400, 360))
    values[300, :180], values[301, 180:] = 0.0, 0.0
    problem = Problem(ConfigurationMap(values), step_s=0.1)
    assert all(grid.state_count(400) <= MOST_FINE_STATES for grid in fine_grids(problem))
    outcome = dynamic_programming(problem)
    assert isinstance(outcome, NoPlan)
    assert outcome.location == 301


def test_a_corridor_one_sample_wide_is_followed() -> None:
    values = np.zeros((15, 12))
    values[:, 7] = 0.4
    plan = planned(Problem(ConfigurationMap(values)))
    assert plan.angles_deg == pytest.approx(np.full(15, 210.0))


@pytest.mark.parametrize(("step_s", "forbidden", "seed"), [(0.1, 0.3, 7), (0.25, 0.4, 7), (0.4, 0.6, 3), (0.1, 0.6, 2)])
def test_where_the_first_grid_finds_no_way_the_fine_one_does(step_s: float, forbidden: float, seed: int) -> None:
    family = MapFamily(forbidden, 2.0, location_count=25, angle_count=40)
    problem = Problem(synthetic_map(family, seed), step_s=step_s)
    assert follow(problem, cost_to_go(problem, default_grid(problem))) is None
    assert not is_forbidden_on_the_way(problem.map, planned(problem))


@pytest.mark.parametrize("scale", [1e-30, 1e30, 1e200])
def test_extreme_weights_still_give_a_plan(scale: float) -> None:
    problem = Problem(synthetic_map(SMALL, 1), step_s=0.3, weights=Weights(scale, scale))
    plan = planned(problem)
    assert math.isfinite(plan.cost.total)
    assert not is_forbidden_on_the_way(problem.map, plan)


def test_a_path_of_two_locations_is_planned() -> None:
    plan = planned(Problem(ConfigurationMap(np.array([[1.0] * 8, [0.5] * 8]))))
    assert plan.cost.total == pytest.approx(0.5)


def test_a_blocked_location_is_named() -> None:
    values = np.ones((6, 8))
    values[4] = 0.0
    outcome = dynamic_programming(Problem(ConfigurationMap(values)))
    assert isinstance(outcome, NoPlan)
    assert (outcome.infeasibility, outcome.location) == (Infeasibility.BLOCKED_LOCATION, 4)


def test_a_grid_of_ones_own_is_used() -> None:
    problem = Problem(synthetic_map(SMALL._replace(forbidden=0.1), 0), step_s=0.3)
    grid = default_grid(problem, refinement=1, speed_count=21, jump_count=5)
    plan = dynamic_programming(problem, grid)
    assert isinstance(plan, Plan)
    on_grid = plan.speeds_deg_s / grid.speed_step_deg_s
    assert on_grid == pytest.approx(np.round(on_grid), abs=1e-6)
