import numpy as np
import pytest

from planner.map.config_map import ConfigurationMap
from planner.plans.problem import Problem
from planner.search.lattice import speed_unit
from planner.search.lattice_choice import EXACTLY, limits_rounded_up, turn_lattice, with_limits_rounded_up
from planner.table.motion import Limits


def problem_of(angle_count: int, step_s: float, limits: Limits) -> Problem:
    return Problem(ConfigurationMap(np.ones((60, angle_count))), step_s, limits)


@pytest.mark.parametrize("angle_count", [8, 36, 100, 360, 1440])
@pytest.mark.parametrize("step_s", [0.05, 0.25, 1.0])
@pytest.mark.parametrize("limits", [Limits(), Limits(13.0, 70.0), Limits(39.5, 300.0)])
def test_its_speeds_keep_the_limits_and_nearly_reach_them(angle_count: int, step_s: float, limits: Limits) -> None:
    problem = problem_of(angle_count, step_s, limits)
    lattice = turn_lattice(problem, 8, 100_000_000)
    assert lattice is not None
    unit = speed_unit(lattice, step_s)
    assert 0.97 * limits.speed_deg_s <= lattice.half_count * unit <= limits.speed_deg_s * (1 + 1e-9)
    assert lattice.half_count >= 8
    assert 2 * unit <= limits.acceleration_deg_s2 * step_s * (1 + 1e-9)
    assert lattice.q_count * 2 * lattice.node_deg == pytest.approx(360.0)


@pytest.mark.parametrize("angle_count", [36, 100, 360])
def test_at_rest_it_stands_on_every_sample_unless_samples_are_closer_than_needed(angle_count: int) -> None:
    lattice = turn_lattice(problem_of(angle_count, 0.25, Limits()), 8, 100_000_000)
    assert lattice is not None
    assert lattice.q_count % angle_count == 0


def test_close_samples_need_not_all_be_nodes() -> None:
    lattice = turn_lattice(problem_of(1440, 0.25, Limits()), 8, 100_000_000)
    assert lattice is not None
    assert lattice.q_count < 1440
    assert 1440 % lattice.q_count == 0


def test_the_greatest_speed_can_be_asked_for_exactly() -> None:
    problem = problem_of(100, 0.25, Limits(40.0, 100.0))
    lattice = turn_lattice(problem, 8, 100_000_000, share=EXACTLY)
    assert lattice is not None
    assert lattice.half_count * speed_unit(lattice, 0.25) == pytest.approx(40.0)


def test_a_lattice_that_takes_too_much_work_is_none() -> None:
    assert turn_lattice(problem_of(100, 0.25, Limits()), 8, 10_000) is None


def test_limits_are_rounded_up_to_the_next_speed_of_the_lattice() -> None:
    problem = problem_of(100, 0.25, Limits(40.0, 100.0))
    lattice = turn_lattice(problem, 8, 200_000)
    assert lattice is not None
    unit = speed_unit(lattice, 0.25)
    rounded = limits_rounded_up(lattice, problem)
    assert 40.0 <= rounded.speed_deg_s < 40.0 + unit
    assert 100.0 <= rounded.acceleration_deg_s2 < 100.0 + unit / 0.25
    assert with_limits_rounded_up(lattice, problem).half_count * unit == pytest.approx(rounded.speed_deg_s)
