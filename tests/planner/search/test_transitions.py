import numpy as np
import pytest

from planner.map.synthetic_maps import MapFamily, synthetic_map
from planner.plans.problem import Problem
from planner.search.state_grid import Grid, default_grid
from planner.search.transitions import lay_out_transitions
from planner.table.motion import Limits

MAP = synthetic_map(MapFamily(location_count=10, angle_count=36), 0)

# Slow steps within a sample; the default; fast steps of more than a turn.
PROBLEMS = [
    Problem(MAP, step_s=0.05, limits=Limits(40.0, 200.0)),
    Problem(MAP, step_s=0.5),
    Problem(MAP, step_s=12.0, limits=Limits(40.0, 5.0)),
]


@pytest.mark.parametrize("problem", PROBLEMS, ids=["slow", "default", "turning"])
def test_a_step_moves_and_sweeps_what_its_exact_motion_does(problem: Problem) -> None:
    grid = default_grid(problem)
    steps = lay_out_transitions(problem.terms, grid, 1.0)
    speeds_deg_s = grid.speeds_deg_s
    time_s = np.linspace(0.0, problem.step_s, 2001)
    for i, start_deg_s in enumerate(speeds_deg_s):
        for a in range(steps.step_count[i]):
            acceleration_deg_s2 = (speeds_deg_s[steps.target[i, a]] - start_deg_s) / problem.step_s
            way = (start_deg_s * time_s + 0.5 * acceleration_deg_s2 * time_s**2) * grid.angle_count / 360.0
            off = (steps.shift[i, a] + steps.fraction[i, a] - way[-1]) % grid.angle_count
            assert min(off, grid.angle_count - off) < 1e-4
            lowest, highest = np.floor(way.min() + 1e-4), np.ceil(way.max() - 1e-4)
            assert (steps.sweep_start[i, a] - lowest) % grid.angle_count == 0
            assert steps.sweep_length[i, a] == min(highest - lowest, grid.angle_count)


@pytest.mark.parametrize("problem", PROBLEMS, ids=["slow", "default", "turning"])
def test_places_stay_within_a_turn(problem: Problem) -> None:
    grid = default_grid(problem)
    steps = lay_out_transitions(problem.terms, grid, 1.0)
    assert np.abs(steps.shift).max() < grid.angle_count
    assert np.abs(steps.sweep_start).max() < grid.angle_count
    assert 0.0 <= steps.fraction.min() <= steps.fraction.max() <= 1.0


def test_steps_that_leave_the_grid_are_none() -> None:
    grid = Grid(36, 0.0, 10.0, 2, np.array([-3, 0, 1]))
    steps = lay_out_transitions(PROBLEMS[1].terms, grid, 1.0)
    ends = [steps.target[i, : steps.step_count[i]].tolist() for i in range(5)]
    assert ends == [[0, 1], [1, 2], [2, 3], [0, 3, 4], [1, 4]]


def test_the_cost_is_that_of_the_acceleration_in_units() -> None:
    grid = Grid(36, 0.0, 10.0, 2, np.array([-1, 0, 2]))
    steps = lay_out_transitions(PROBLEMS[1].terms, grid, 0.5)
    weight = PROBLEMS[1].terms.acceleration_weight
    assert steps.cost[2] == pytest.approx([weight * 20.0**2 / 0.5, 0.0, weight * 40.0**2 / 0.5])
