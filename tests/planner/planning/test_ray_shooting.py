"""Algorithm 2 and `evalpath` as they must be read; each test describes the effect of the printed version."""

import itertools

import numpy as np
import pytest

from planner.map.config_map import ConfigurationMap
from planner.map.synthetic_maps import MapFamily, synthetic_map
from planner.planning.dynamic_programming import dynamic_programming
from planner.planning.ray_shooting import (
    RayError,
    Rays,
    cheapest_ray,
    guided_ray_shooting,
    no_cost_to_go,
    ray_accelerations,
    ray_cost,
    ray_shooting,
)
from planner.plans.plan import NoPlan, Plan
from planner.plans.problem import Problem
from planner.table.motion import Limits
from tests.planner.exhaustive_search import is_forbidden_on_the_way, motion

PLANNERS = [ray_shooting, guided_ray_shooting]


def evalpath(problem: Problem, start: tuple[float, float], acceleration: float, column: int, last: int) -> float:
    """Call the compiled ray, without cost-to-go and without a bound."""
    return ray_cost(problem.terms, acceleration, column, last, no_cost_to_go(problem), *start, np.inf)


def open_problem(seed: int = 0, locations: int = 8) -> Problem:
    return Problem(synthetic_map(MapFamily(forbidden=0.0, location_count=locations, angle_count=60), seed))


def test_a_ray_costs_equation_7_along_equation_4() -> None:
    # As printed, omega is updated before theta: each step gains a dt^2 too much; and - f_R may
    # make a cost negative.
    problem = open_problem()
    a = 60.0
    states = motion((33.0, -5.0), [a] * 7, problem.step_s)[1:]
    expected = sum(
        problem.terms.acceleration_weight * a**2
        + problem.terms.speed_weight * speed**2
        + (1.0 - problem.map.value(k, angle))
        for k, (angle, speed) in enumerate(states, start=1)
    )
    assert evalpath(problem, (33.0, -5.0), a, 0, 7) == pytest.approx(expected, rel=1e-12)


def test_a_bright_motionless_ray_is_free() -> None:
    problem = Problem(ConfigurationMap(np.ones((5, 8))))
    assert evalpath(problem, (45.0, 0.0), 0.0, 0, 4) == 0.0


def test_after_leaving_the_allowed_region_every_remaining_step_costs_c_pen() -> None:
    # As printed, a ray that leaves early pays once, and so costs less than one that leaves late.
    values = np.ones((9, 8))
    values[4, 2] = 0.0
    problem = Problem(ConfigurationMap(values))
    assert evalpath(problem, (90.0, 0.0), 0.0, 0, 8) == pytest.approx(5 * problem.terms.pause_cost)
    assert evalpath(problem, (90.0, 0.0), 0.0, 2, 8) == pytest.approx(5 * problem.terms.pause_cost)


def test_c_pen_exceeds_the_greatest_cost_of_an_allowed_step() -> None:
    problem = open_problem()
    assert problem.terms.pause_cost > problem.greatest_step_cost


def test_within_a_ray_the_speed_saturates() -> None:
    # The printed algorithm omits the limits.
    problem = Problem(ConfigurationMap(np.ones((31, 8))))
    limit = problem.limits.speed_deg_s
    last_step = evalpath(problem, (0.0, limit), 100.0, 29, 30)
    assert last_step == pytest.approx(problem.terms.speed_weight * limit**2)


def test_the_accelerations_are_odd_symmetric_and_denser_near_zero() -> None:
    accelerations = ray_accelerations(21, 100.0)
    ordered = np.sort(accelerations)
    assert ordered == pytest.approx(-ordered[::-1])
    assert ordered[10] == 0.0
    assert ordered[-1] == 100.0
    assert np.all(np.diff(ordered[10:], 2) > 0.0)
    assert ordered[15] == pytest.approx(25.0)


def test_of_equal_rays_the_one_of_least_acceleration_is_taken() -> None:
    # All rays meet the wall in their first step and cost the same; the printed argmin would use full deceleration.
    values = np.ones((4, 8))
    values[1] = 0.0
    problem = Problem(ConfigurationMap(values))
    accelerations = ray_accelerations(21, 100.0)
    best = cheapest_ray(problem.terms, accelerations, 0, 3, no_cost_to_go(problem), 0.0, 0.0)
    assert accelerations[best] == 0.0


def test_the_rays_of_step_k_see_column_k_plus_1() -> None:
    # As printed they start one column later, so a wall in column 1 would not be detected.
    values = np.ones((6, 36))
    values[1, 10:13] = 0.0
    values[0, 9:12] = 0.1
    limits = Limits(40.0, 400.0)
    problem = Problem(ConfigurationMap(values), step_s=1.0, limits=limits, start_angle_deg=80.0, start_speed_deg_s=20.0)
    plan = ray_shooting(problem)
    assert isinstance(plan, Plan)
    assert plan.pauses == ()
    assert not is_forbidden_on_the_way(problem.map, plan)


def test_theta_advances_by_the_chosen_rays_first_step() -> None:
    # As printed theta is never advanced: every step would start from the first angle.
    problem = open_problem(seed=5, locations=30)
    plan = ray_shooting(problem)
    assert isinstance(plan, Plan)
    states = motion((plan.angles_deg[0], 0.0), list(plan.accelerations_deg_s2), problem.step_s)
    assert plan.angles_deg == pytest.approx([angle for angle, _ in states])
    assert np.ptp(plan.angles_deg) > 1.0
    for k, (angle, speed) in itertools.islice(enumerate(states), problem.step_count):
        accelerations = ray_accelerations(21, problem.limits.acceleration_deg_s2)
        best = cheapest_ray(problem.terms, accelerations, k, 30, no_cost_to_go(problem), angle, speed)
        chosen = plan.accelerations_deg_s2[k]
        assert abs(chosen) <= abs(accelerations[best]) + 1e-9
        assert chosen * accelerations[best] >= 0.0


def test_a_fallback_pauses_and_goes_on_at_rest() -> None:
    # A wall across all reachable angles; as printed, the speed before the fallback would be kept.
    values = np.ones((12, 36))
    values[6, :20] = 0.0
    problem = Problem(ConfigurationMap(values), start_angle_deg=90.0, start_speed_deg_s=30.0)
    plan = ray_shooting(problem)
    assert isinstance(plan, Plan)
    assert [pause.step for pause in plan.pauses] == [5]
    assert plan.speeds_deg_s[6] == 0.0
    assert plan.angles_deg[6] == plan.pauses[0].to_angle_deg
    assert problem.map.is_allowed(6, float(plan.angles_deg[6]))
    assert plan.cost.pauses == problem.terms.pause_cost


@pytest.mark.parametrize("planner", PLANNERS)
@pytest.mark.parametrize("seed", range(3))
def test_outside_pauses_the_plan_is_never_forbidden_and_within_limits(planner: type, seed: int) -> None:
    problem = Problem(synthetic_map(MapFamily(0.35, 4.0, location_count=40, angle_count=60), seed), step_s=0.25)
    plan = planner(problem)
    assert isinstance(plan, Plan)
    assert not is_forbidden_on_the_way(problem.map, plan)
    assert np.abs(plan.speeds_deg_s).max() <= problem.limits.speed_deg_s + 1e-9
    assert np.abs(plan.accelerations_deg_s2).max() <= problem.limits.acceleration_deg_s2 + 1e-9


@pytest.mark.parametrize("planner", PLANNERS)
def test_a_horizon_longer_than_the_map_ends_at_its_last_column(planner: type) -> None:
    problem = open_problem()
    longest = planner(problem, Rays(horizon=7))
    assert planner(problem, Rays(horizon=1000)).angles_deg.tolist() == longest.angles_deg.tolist()


def test_the_cost_to_go_shows_rays_what_lies_behind_their_horizon() -> None:
    problem = Problem(synthetic_map(MapFamily(0.3, 5.0, location_count=60, angle_count=60), 2), step_s=0.25)
    optimal = dynamic_programming(problem)
    assert isinstance(optimal, Plan)
    from_there = Problem(problem.map, 0.25, start_angle_deg=float(optimal.angles_deg[0]))
    short = ray_shooting(from_there, Rays(horizon=2))
    guided = guided_ray_shooting(from_there, Rays(horizon=2))
    assert isinstance(short, Plan)
    assert isinstance(guided, Plan)
    assert guided.cost.total < short.cost.total
    assert guided.cost.total < 1.02 * optimal.cost.total


@pytest.mark.parametrize("planner", PLANNERS)
def test_a_blocked_location_is_a_result(planner: type) -> None:
    values = np.ones((4, 8))
    values[2] = 0.0
    assert isinstance(planner(Problem(ConfigurationMap(values))), NoPlan)


@pytest.mark.parametrize("rays", [Rays(rays=20), Rays(rays=1), Rays(rays=-3), Rays(horizon=0)])
def test_a_set_of_rays_that_is_none_is_refused(rays: Rays) -> None:
    with pytest.raises(RayError, match="allowed"):
        ray_shooting(open_problem(), rays)
