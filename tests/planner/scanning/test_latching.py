from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.scanning.latching import Drop, Pairing, RobotLatch, TableReading, Tolerances, Trigger, pair

PERIOD_S = 0.04
COUNT = 40
TRIGGERS = [Trigger(k, 1.0 + k * PERIOD_S) for k in range(COUNT)]


def angle_at(time_s: float) -> float:
    return 10.0 + 12.0 * time_s  # 0.48 deg from one trigger to the next


def joints_at(time_s: float) -> np.ndarray:
    return np.full(6, time_s)


def robot_of(times_s: list[float]) -> list[RobotLatch]:
    return [RobotLatch(time_s + 0.0001, joints_at(time_s)) for time_s in times_s]


def table_of(edges_s: list[float], reads_s: list[float]) -> list[TableReading]:
    """Return the replies of a table that latches at some times and is read at others."""
    readings = []
    for read_s in reads_s:
        latched = [edge for edge in edges_s if edge <= read_s]
        if latched:
            readings.append(TableReading(read_s, read_s + 0.003, round(angle_at(max(latched)), 1)))
    return readings


TIMES_S = [trigger.time_s for trigger in TRIGGERS]
READS_S = [time_s + 0.002 for time_s in TIMES_S]


def paired(robot_s: list[float] = TIMES_S, edges_s: list[float] = TIMES_S, reads_s: list[float] = READS_S) -> Pairing:
    return pair(TRIGGERS, robot_of(robot_s), table_of(edges_s, reads_s), angle_at)


def without(times_s: list[float], *numbers: int) -> list[float]:
    return [time_s for k, time_s in enumerate(times_s) if k not in numbers]


def doubled(times_s: list[float], number: int, after_s: float) -> list[float]:
    return sorted([*times_s, times_s[number] + after_s])


def assert_paired_but(pairing: Pairing, dropped: dict[int, Drop]) -> None:
    """Each profile except the dropped ones has the pose and the angle of its own trigger."""
    assert pairing.dropped == dropped
    assert pairing.numbers.tolist() == [k for k in range(COUNT) if k not in dropped]
    times_s = np.array(TIMES_S)[pairing.numbers]
    assert pairing.joints_deg[:, 0] == pytest.approx(times_s)
    assert np.abs(pairing.angles_deg - angle_at(times_s)).max() <= 0.05 + 1e-9  # type: ignore[arg-type] # of all times


def test_without_faults_every_profile_is_paired() -> None:
    assert_paired_but(paired(), {})


@pytest.mark.parametrize(
    ("case", "dropped"),
    [
        (lambda: paired(robot_s=without(TIMES_S, 7)), {7: Drop.ROBOT_MISSED}),
        (lambda: paired(robot_s=without(TIMES_S, 0, 1, 2)), dict.fromkeys((0, 1, 2), Drop.ROBOT_MISSED)),
        (lambda: paired(robot_s=doubled(TIMES_S, 7, 0.02)), {}),
        (lambda: paired(robot_s=doubled(TIMES_S, 7, 0.0005)), {}),
        (lambda: paired(edges_s=without(TIMES_S, 7)), {7: Drop.TABLE_STRAY}),
        (lambda: paired(edges_s=without(TIMES_S, 7, 8)), dict.fromkeys((7, 8), Drop.TABLE_STRAY)),
        (lambda: paired(edges_s=doubled(TIMES_S, 7, 0.02)), {}),  # read before the second edge came
        (
            lambda: paired(edges_s=doubled(TIMES_S, 7, 0.02), reads_s=[*without(READS_S, 7), TIMES_S[7] + 0.025]),
            {7: Drop.TABLE_STRAY},
        ),
        (lambda: paired(reads_s=without(READS_S, 7)), {7: Drop.TABLE_UNREAD}),
        (lambda: paired(reads_s=[*without(READS_S, 7), TIMES_S[8] + 0.001]), {7: Drop.TABLE_UNREAD}),
        # In transmission while the next trigger comes: it may belong to either.
        (lambda: paired(reads_s=[*without(READS_S, 7), TIMES_S[8] - 0.001]), {7: Drop.TABLE_UNREAD}),
        (lambda: paired(reads_s=sorted(READS_S + [time_s + 0.015 for time_s in TIMES_S])), {}),
        (lambda: paired(robot_s=without(TIMES_S, 5), edges_s=without(TIMES_S, 5)), {5: Drop.ROBOT_MISSED}),
    ],
)
def test_a_fault_drops_its_own_profile_and_shifts_no_other(
    case: Callable[[], Pairing], dropped: dict[int, Drop]
) -> None:
    assert_paired_but(case(), dropped)


numbers = st.frozensets(st.integers(0, COUNT - 1), max_size=8)


@settings(max_examples=100)
@given(robot_misses=numbers, robot_doubles=numbers, table_misses=numbers, table_doubles=numbers, unread=numbers)
def test_no_mixture_of_faults_gives_a_profile_another_ones_pose(
    robot_misses: frozenset[int],
    robot_doubles: frozenset[int],
    table_misses: frozenset[int],
    table_doubles: frozenset[int],
    unread: frozenset[int],
) -> None:
    half_s = 0.5 * PERIOD_S
    robot_s = without(TIMES_S, *robot_misses) + [TIMES_S[k] + half_s for k in robot_doubles]
    edges_s = without(TIMES_S, *table_misses) + [TIMES_S[k] + half_s for k in table_doubles]
    pairing = paired(robot_s, edges_s, without(READS_S, *unread))
    times_s = np.array(TIMES_S)[pairing.numbers]
    assert pairing.joints_deg[:, 0] == pytest.approx(times_s)
    assert (np.abs(pairing.angles_deg - [angle_at(time_s) for time_s in times_s]) <= 0.13 + 1e-9).all()
    faulty = robot_misses | table_misses | unread
    assert set(pairing.dropped) >= robot_misses | unread
    if len(table_misses) <= 2:  # so that most readings around each are correct
        assert set(pairing.dropped) == faulty


def test_a_steady_distance_from_the_plan_is_no_fault() -> None:
    pairing = pair(TRIGGERS, robot_of(TIMES_S), table_of(TIMES_S, READS_S), lambda time_s: angle_at(time_s) + 3.0)
    assert_paired_but(pairing, {})


def test_a_table_at_rest_cannot_be_stale() -> None:
    readings = [TableReading(time_s, time_s + 0.003, 20.0) for time_s in READS_S]
    assert not pair(TRIGGERS, robot_of(TIMES_S), readings, lambda _: 20.0).dropped


def test_the_robots_stamp_may_be_off_by_its_tolerance_only() -> None:
    late = [RobotLatch(time_s + 0.002, joints_at(time_s)) for time_s in TIMES_S]
    readings = table_of(TIMES_S, READS_S)
    assert set(pair(TRIGGERS, late, readings, angle_at).dropped.values()) == {Drop.ROBOT_MISSED}
    assert not pair(TRIGGERS, late, readings, angle_at, Tolerances(robot_s=0.003)).dropped


def test_nothing_latched_leaves_nothing() -> None:
    pairing = pair(TRIGGERS, [], [], angle_at)
    assert pairing.joints_deg.shape == (0, 6)
    assert len(pairing.dropped) == COUNT
    assert len(pair([], [], [], angle_at).numbers) == 0
