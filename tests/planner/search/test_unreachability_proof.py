"""Attacks on the proof: there must be none if a motion exists. `python -m tools.bench planner` tries 1000 maps."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.map.config_map import ConfigurationMap
from planner.map.synthetic_maps import MapFamily, synthetic_map
from planner.plans.plan import make_plan
from planner.plans.problem import Problem
from planner.plans.verification import verify
from planner.search.lattice_choice import turn_lattice
from planner.search.lattice_search import best_motion
from planner.search.unreachability_proof import first_unreachable_location, widening_between
from planner.table.motion import Limits, swept_angles
from tests.planner.exhaustive_search import least_cost
from tools.bench.planner_families import around_a_motion


@pytest.mark.parametrize("seed", range(120))
def test_a_map_around_a_known_motion_is_never_proved_impossible(seed: int) -> None:
    problem, motion = around_a_motion(seed)
    assert verify(problem, make_plan(problem, "known", *motion)).is_executable
    for cells in (4, 32, 64):
        assert first_unreachable_location(problem, cells) is None


@pytest.mark.parametrize("forbidden", [0.5, 0.65])
def test_on_tiny_maps_it_never_contradicts_trying_every_motion(forbidden: float) -> None:
    proved = 0
    for seed in range(20):
        configuration_map = synthetic_map(MapFamily(forbidden, 1.0, location_count=5, angle_count=18), seed)
        start_deg = 20.0 * int(np.argmax(configuration_map.values[0]))
        problem = Problem(configuration_map, step_s=1.0, limits=Limits(40.0, 40.0), start_angle_deg=start_deg)
        if configuration_map.blocked_locations or first_unreachable_location(problem, 32) is None:
            continue
        proved += 1
        assert math.isinf(least_cost(problem, [-40.0, -20.0, 0.0, 20.0, 40.0]))
        lattice = turn_lattice(problem, 20, 1_000_000)
        assert lattice is not None
        assert best_motion(problem, lattice) is None
    assert proved >= 3


ASIDE = st.just(0.0) | st.floats(0.0, 20.0)


@settings(max_examples=400, deadline=None)
@given(
    speed=st.floats(-40.0, 40.0),
    change=st.floats(-80.0, 80.0),
    slack=ASIDE,
    aside=st.tuples(ASIDE, ASIDE, ASIDE, ASIDE),
    step_s=st.floats(0.1, 2.0),
)
def test_no_step_between_two_cells_does_more_or_less_than_they_are_said_to_do(
    speed: float, change: float, slack: float, aside: tuple[float, float, float, float], step_s: float
) -> None:
    later, gain = speed + change, abs(change) + slack
    low, high, later_low, later_high = speed - aside[0], speed + aside[1], later - aside[2], later + aside[3]
    said = widening_between(low, high, later_low, later_high, gain, 0.5 * step_s)
    lowest, highest = swept_angles(0.0, speed, (later - speed) / step_s, step_s)
    moved = 0.5 * (speed + later) * step_s
    assert said.least <= moved <= said.most
    for beyond, origin in ((said.beyond_start, 0.0), (said.beyond_end, moved)):
        assert max(beyond, 0.0) <= highest - origin + 1e-9
        assert min(beyond, 0.0) >= lowest - origin - 1e-9


def wall_with_a_gap(distance: int) -> Problem:
    """Return a map that needs a turn by the given samples of 3.6 deg in 10 steps of 0.5 s, from rest to rest."""
    values = np.ones((14, 100))
    values[1] = values[12] = 0.0
    values[1, 20] = values[12, 20 + distance] = 1.0
    return Problem(ConfigurationMap(values), 0.5)


def test_it_tells_what_the_limits_allow_from_what_they_do_not() -> None:
    # At rest on columns 1, 2, 11 and 12: nine steps in between, eight columns at 40 deg/s make 160 deg, 44.4 samples.
    assert first_unreachable_location(wall_with_a_gap(44), 256) is None
    assert first_unreachable_location(wall_with_a_gap(45), 256) == 12
    assert first_unreachable_location(wall_with_a_gap(47), 32) == 12


def test_a_proof_that_takes_too_much_work_is_given_up() -> None:
    values = 0.1 + 0.9 * np.random.default_rng(1).random((20, 360))
    values[values < 0.3] = 0.0
    values[18, 20:], values[19, :30] = 0.0, 0.0
    problem = Problem(ConfigurationMap(values), 0.05)
    assert first_unreachable_location(problem, 32) == 19
    assert first_unreachable_location(problem, 8000) is None


def test_reversing_within_one_sample_takes_room() -> None:
    # A single sample must be passed at rest, so the table cannot come from 30 deg/s.
    values = np.zeros((4, 36))
    values[:, 7] = 1.0
    for speed in (0.0, 1.0, 30.0):
        problem = Problem(ConfigurationMap(values), 0.25, start_angle_deg=70.0, start_speed_deg_s=speed)
        location = first_unreachable_location(problem, 256)
        assert location is None if speed == 0.0 else location == 1


def test_a_start_in_a_dead_end_is_proved_though_others_cross() -> None:
    values = np.ones((20, 36))
    values[5:, 10:30] = 0.0
    assert first_unreachable_location(Problem(ConfigurationMap(values), 0.1, start_angle_deg=200.0), 32) is not None
    assert first_unreachable_location(Problem(ConfigurationMap(values), 0.1, start_angle_deg=20.0), 32) is None
    assert first_unreachable_location(Problem(ConfigurationMap(values), 0.1), 32) is None
