import numpy as np
import pytest

from planner.map.config_map import ConfigurationMap
from planner.map.synthetic_maps import MapFamily, synthetic_map
from planner.plans.crossing import step_is_allowed
from planner.plans.plan import make_plan
from planner.plans.problem import Problem
from planner.plans.verification import verify
from planner.search.crossable_intervals import crossable_intervals, crossing_motion, speeds_of
from planner.search.interval_union import contains
from planner.table.motion import Limits
from tests.planner.exhaustive_search import is_forbidden_on_the_way
from tools.bench.planner_families import fast_corridor


def can_cross(problem: Problem, speeds: list[float], column: int, angle_deg: float, speed: float) -> bool:
    """Try every sequence of the speeds, by the crossing rule alone."""
    if column == problem.step_count:
        return True
    for later in speeds:
        acceleration = (later - speed) / problem.step_s
        if abs(acceleration) <= problem.limits.acceleration_deg_s2 * (1 + 1e-9):
            end = angle_deg + 0.5 * (speed + later) * problem.step_s
            allowed = step_is_allowed(problem.terms.runs, column, angle_deg, speed, acceleration, problem.step_s)
            if allowed and can_cross(problem, speeds, column + 1, end, later):
                return True
    return False


@pytest.mark.parametrize(
    ("limits", "speeds_per_gain", "start_deg_s", "speeds_deg_s"),
    [
        (Limits(40.0, 40.0), 2, None, np.arange(-40.0, 41.0, 10.0)),  # 20 deg/s in a step, in halves
        (Limits(40.0, 100.0), 2, None, np.arange(-40.0, 41.0, 20.0)),  # the limit is less than the change in a step
        (Limits(45.0, 40.0), 1, None, [-45.0, -40.0, -20.0, 0.0, 20.0, 40.0, 45.0]),
        (Limits(40.0, 40.0), 1, 7.77, [-40.0, -20.0, 0.0, 7.77, 20.0, 40.0]),
        (Limits(40.0, 40.0), 1, -20.0, [-40.0, -20.0, 0.0, 20.0, 40.0]),
    ],
)
def test_the_speeds_are_multiples_of_a_share_of_what_a_step_changes(
    limits: Limits, speeds_per_gain: int, start_deg_s: float | None, speeds_deg_s: list[float]
) -> None:
    free = ConfigurationMap(np.ones((20, 36)))
    problem = Problem(free, 0.5, limits, start_speed_deg_s=start_deg_s)
    assert speeds_of(problem, speeds_per_gain) == pytest.approx(speeds_deg_s)


@pytest.mark.parametrize("seed", range(8))
def test_an_angle_is_crossable_exactly_if_some_sequence_of_the_speeds_crosses_from_it(seed: int) -> None:
    family = MapFamily(0.45, 1.0, location_count=5, angle_count=20)
    problem = Problem(synthetic_map(family, seed), 0.5, Limits(40.0, 60.0))
    speeds = speeds_of(problem, 1)
    crossable = crossable_intervals(problem.terms, speeds)
    verdicts = []
    for angle in np.arange(0.0, 360.0, 4.5):
        for s in range(len(speeds)):
            first, count = crossable.first[0, s], crossable.interval_count[0, s]
            lows, highs = crossable.lows[first : first + count], crossable.highs[first : first + count]
            found = contains(lows, highs, angle / 18.0, 20.0, 1e-9)
            assert found == can_cross(problem, speeds.tolist(), 0, float(angle), float(speeds[s]))
            verdicts.append(found)
    assert 0.0 < np.mean(verdicts) < 1.0


@pytest.mark.parametrize("seed", range(12))
def test_a_corridor_near_the_speed_limit_is_crossed(seed: int) -> None:
    problem = fast_corridor(seed)
    motion = crossing_motion(problem, 4)
    assert motion is not None
    plan = make_plan(problem, "crossing", *motion)
    assert verify(problem, plan).is_executable
    assert not is_forbidden_on_the_way(problem.map, plan)


def test_the_start_is_kept_and_its_speed_is_one_of_the_speeds() -> None:
    configuration_map = synthetic_map(MapFamily(0.1, 4.0, location_count=20, angle_count=36), 2)
    problem = Problem(configuration_map, 0.25, start_angle_deg=-777.7, start_speed_deg_s=7.77)
    motion = crossing_motion(problem, 4)
    assert motion is not None
    assert (motion.angles_deg[0], motion.speeds_deg_s[0]) == (-777.7, 7.77)


def test_a_map_without_obstacles_is_crossable_from_everywhere() -> None:
    problem = Problem(ConfigurationMap(np.ones((6, 12))))
    crossable = crossable_intervals(problem.terms, speeds_of(problem, 2))
    assert np.all(crossable.interval_count == 1)
    assert np.all(crossable.highs - crossable.lows == 12.0)


def test_intervals_that_take_too_much_work_are_given_up() -> None:
    values = 0.1 + 0.9 * np.random.default_rng(1).random((20, 360))
    values[values < 0.2] = 0.0
    problem = Problem(ConfigurationMap(values), 0.25)
    assert crossing_motion(problem, 4) is not None
    assert crossing_motion(problem, 250) is None


def test_where_there_is_no_way_there_is_no_motion() -> None:
    values = np.ones((6, 12))
    values[2, :6], values[3, 6:] = 0.0, 0.0
    assert crossing_motion(Problem(ConfigurationMap(values)), 4) is None
