import numpy as np
import pytest

from planner.map.synthetic_maps import MapFamily, synthetic_map
from planner.planning.interpolated_planner import interpolated_plan
from planner.plans.plan import Plan
from planner.plans.problem import Problem
from planner.plans.verification import verify
from planner.search.state_grid import default_grid
from tests.planner.exhaustive_search import is_forbidden_on_the_way, motion

SMALL = MapFamily(0.1, 4.0, location_count=25, angle_count=40)


@pytest.mark.parametrize("step_s", [0.1, 0.4])
@pytest.mark.parametrize("seed", range(4))
def test_its_plan_can_be_executed(seed: int, step_s: float) -> None:
    problem = Problem(synthetic_map(SMALL, seed), step_s)
    plan = interpolated_plan(problem)
    assert isinstance(plan, Plan)
    assert verify(problem, plan).is_executable
    assert not is_forbidden_on_the_way(problem.map, plan)
    states = np.array(motion((plan.angles_deg[0], 0.0), plan.accelerations_deg_s2.tolist(), step_s))
    assert plan.angles_deg == pytest.approx(states[:, 0], abs=1e-9)


def test_a_grid_of_ones_own_is_used() -> None:
    problem = Problem(synthetic_map(SMALL, 0), step_s=0.3)
    grid = default_grid(problem, refinement=1, speed_count=21, jump_count=5)
    plan = interpolated_plan(problem, grid)
    assert isinstance(plan, Plan)
    on_grid = plan.speeds_deg_s / grid.speed_step_deg_s
    assert on_grid == pytest.approx(np.round(on_grid), abs=1e-6)


def test_a_given_start_is_kept() -> None:
    plan = interpolated_plan(
        Problem(synthetic_map(SMALL._replace(forbidden=0.0), 1), start_angle_deg=-777.7, start_speed_deg_s=-3.21)
    )
    assert isinstance(plan, Plan)
    assert (plan.angles_deg[0], plan.speeds_deg_s[0]) == (-777.7, -3.21)
