import numpy as np
import pytest

from planner.execution.clear_path import BlockedPathError, check_ends, is_clear, nearest_turns, turns_to_start
from planner.execution.table_motion import TableMotion
from planner.map.config_map import ConfigurationMap
from planner.map.synthetic_maps import blocks_map
from planner.plans.plan import Plan, make_plan
from planner.plans.problem import Problem
from planner.table.motion import Limits, roll_out


@pytest.fixture
def walled() -> ConfigurationMap:
    """Forbidden from 100 to 120 degrees at every location."""
    return blocks_map(8, 360, [(0, 7, 100, 120)], edge=0)


def test_a_path_is_clear_only_where_no_sample_on_it_or_beside_it_is_forbidden(walled: ConfigurationMap) -> None:
    assert is_clear(walled, 0, 50.0, 99.0)
    assert not is_clear(walled, 0, 50.0, 99.5)
    assert not is_clear(walled, 0, 90.0, 130.0)
    assert is_clear(walled, 0, 121.0, 459.0)
    assert not is_clear(walled, 0, -270.0, -230.0)


def test_the_start_is_reached_the_short_way_where_that_is_clear(walled: ConfigurationMap) -> None:
    assert turns_to_start(walled, 90.0, 20.0) == 0
    assert turns_to_start(walled, 710.0, 20.0) == 2
    assert turns_to_start(walled, -350.0, 20.0) == -1


def test_the_start_is_reached_the_other_way_round_where_the_short_one_is_not_free(walled: ConfigurationMap) -> None:
    assert nearest_turns(90.0, 130.0) == 0
    assert turns_to_start(walled, 90.0, 130.0) == -1
    assert turns_to_start(walled, 130.0, 90.0) == 1


def free_by_small_steps(configuration_map: ConfigurationMap, from_deg: float, to_deg: float) -> bool:
    """Return whether each of many angles of the path is allowed at the first location."""
    count = 2 + round(abs(to_deg - from_deg) / 0.2)
    return all(configuration_map.is_allowed(0, float(angle)) for angle in np.linspace(from_deg, to_deg, count))


@pytest.mark.parametrize("seed", range(30))
def test_the_way_to_the_start_is_the_shorter_of_the_free_ones(seed: int) -> None:
    rng = np.random.default_rng(seed)
    values = np.ones((2, 72))
    for first in rng.integers(0, 72, int(rng.integers(0, 3))):
        values[0, (int(first) + np.arange(int(rng.integers(1, 6)))) % 72] = 0.0
    configuration_map = ConfigurationMap(values)
    position_deg, start_deg = round(float(rng.uniform(-800.0, 800.0)), 1), round(float(rng.uniform(-200.0, 560.0)), 1)
    ends_deg = [start_deg + 360.0 * turns for turns in range(-6, 7)]
    ways = {abs(end - position_deg): end for end in ends_deg if abs(end - position_deg) < 360.0}
    free = [way for way, end in ways.items() if free_by_small_steps(configuration_map, position_deg, end)]
    if not free:
        with pytest.raises(BlockedPathError):
            turns_to_start(configuration_map, position_deg, start_deg)
        return
    chosen = start_deg + 360.0 * turns_to_start(configuration_map, position_deg, start_deg)
    assert chosen == pytest.approx(ways[min(free)])


def test_without_a_clear_path_nothing_is_moved() -> None:
    walled_twice = blocks_map(8, 360, [(0, 7, 100, 120), (0, 7, 200, 220)], edge=0)
    with pytest.raises(BlockedPathError, match="retract the arm, and add --arm-away"):
        turns_to_start(walled_twice, 0.0, 150.0)


def moving(angle_deg: float, speed_deg_s: float, configuration_map: ConfigurationMap) -> TableMotion:
    angles, speeds = roll_out(angle_deg, speed_deg_s, np.zeros(7), 0.1)
    plan: Plan = make_plan(Problem(configuration_map), "by hand", angles, speeds, np.zeros(7))
    return TableMotion(plan, Limits())


@pytest.mark.parametrize(
    ("angle_deg", "speed_deg_s", "what"),
    [(84.0, 20.0, "the stop at location 7 takes the table"), (121.5, 20.0, "the run-up at location 0 takes the table")],
)
def test_a_run_up_or_a_stop_through_a_forbidden_region_is_refused(
    walled: ConfigurationMap, angle_deg: float, speed_deg_s: float, what: str
) -> None:
    with pytest.raises(BlockedPathError, match=what):
        check_ends(walled, moving(angle_deg, speed_deg_s, walled))


def test_free_ends_are_accepted(walled: ConfigurationMap) -> None:
    check_ends(walled, moving(30.0, 20.0, walled))
