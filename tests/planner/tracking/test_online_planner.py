"""Whatever becomes known, and whenever: the table can always come to rest in view, and touches no forbidden region."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.arrays import FloatArray
from planner.map.config_map import ConfigurationMap
from planner.map.synthetic_maps import MapFamily, blocks_map, synthetic_map
from planner.planning.dynamic_programming import dynamic_programming
from planner.plans.plan import Pause, Plan, path_cost
from planner.plans.problem import Problem
from planner.table.motion import Limits
from planner.tracking.decision import Method, RayShooting, Receding
from planner.tracking.followed_arm import FollowedArm
from planner.tracking.online_planner import Blocked, KeptStep, Kind, OnlinePlanner, Step, Why
from planner.tracking.revealed_map import WindowError
from tests.planner.tracking.online_examples import STEP_S, begun, faults, tracked

METHODS: list[Method] = [Receding(), RayShooting()]
families = st.builds(
    MapFamily,
    forbidden=st.floats(0.0, 0.5),
    obstacle_size=st.floats(1.0, 8.0),
    slope=st.floats(-6.0, 6.0),
    location_count=st.integers(2, 30),
    angle_count=st.sampled_from([36, 72, 100]),
)
limits_of_tables = st.builds(Limits, st.floats(2.0, 60.0), st.floats(5.0, 200.0))


def begun_for_certain(map_: ConfigurationMap, view: int, method: Method | None = None) -> OnlinePlanner:
    planner = begun(map_, view, method)
    assert planner is not None
    return planner


@settings(max_examples=60, deadline=None)
@given(families, st.integers(0, 99), limits_of_tables, st.integers(1, 40), st.data())
def test_random_reveal_times_never_lead_to_a_state_without_a_way_to_rest(
    family: MapFamily, seed: int, limits: Limits, view: int, data: st.DataObject
) -> None:
    map_ = synthetic_map(family, seed)
    planner = begun(map_, view, data.draw(st.sampled_from(METHODS)), limits)
    if planner is None:
        return
    arrivals = np.cumsum(
        data.draw(st.lists(st.integers(0, 4), min_size=family.location_count, max_size=family.location_count))
    )
    ready = data.draw(st.sets(st.integers(0, 200)))
    steps, blocked = tracked(
        planner, map_, lambda tick: int(np.searchsorted(arrivals, tick, side="right")), lambda tick: tick not in ready
    )
    assert [fault for step in steps for fault in faults(map_, step, limits)] == []
    assert all(before.end == after.start for before, after in pairwise(steps))
    assert planner.state.is_at_rest
    assert planner.is_finished or blocked is not None


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("withheld", [1, 7, 23])
def test_when_locations_stop_coming_the_table_rests_in_view_and_goes_on_when_they_come(
    method: Method, withheld: int
) -> None:
    map_ = synthetic_map(MapFamily(slope=0.8, location_count=40, angle_count=100), 3)
    planner = begun_for_certain(map_, 10, method)
    steps, _ = tracked(planner, map_, lambda tick: withheld if tick < 60 else 99)
    waits = [step for step in steps[5:60] if step.kind is Kind.WAIT]
    assert waits
    assert all(step.why is Why.NO_LOCATION and step.end.location <= withheld - 1 for step in waits)
    assert planner.is_finished
    assert [fault for step in steps for fault in faults(map_, step)] == []


def test_a_decision_that_is_not_ready_lets_the_kept_motion_go_on() -> None:
    map_ = synthetic_map(MapFamily(slope=0.8, location_count=40), 0)
    planner = begun_for_certain(map_, 20)
    tracked(planner, map_, lambda _: 99, ticks=6)
    kept = planner.kept
    assert kept
    for expected in kept:
        step = planner.step(may_decide=False)
        assert not isinstance(step, Blocked)
        assert (step.end, step.why) == (expected.end, Why.NOT_IN_TIME)
    waiting = planner.step(may_decide=False)
    assert not isinstance(waiting, Blocked)
    assert waiting.kind is Kind.WAIT


def corridor(width: int = 19, drift: int = 8) -> ConfigurationMap:
    """Return a map whose only allowed angles are a corridor that gets faster, up to some degrees a column.

    It is so narrow that a table that follows it cannot brake along it: it would leave it behind.
    """
    values, first = np.zeros((40, 360)), 100
    for k in range(40):
        values[k, np.arange(first, first + width) % 360] = 0.8
        first += min(drift, max(0, k - 3))
    return ConfigurationMap(values)


def test_in_a_corridor_too_fast_to_brake_along_the_table_halts_at_a_location_when_it_has_to() -> None:
    map_ = corridor()
    planner = begun_for_certain(map_, 12, Receding())
    steps: list[Step] = []
    for _ in range(map_.location_count):
        steps += tracked(planner, map_, lambda _: 99, ticks=1)[0]
        if planner.kept and planner.kept[-1].halts:
            break
    while planner.kept:
        step = planner.step(may_decide=False)
        assert not isinstance(step, Blocked)
        steps.append(step)
    assert steps[-1].kind is Kind.HALT
    assert not steps[-1].start.is_at_rest
    assert steps[-1].end == steps[-1].start._replace(speed_deg_s=0.0)
    steps += tracked(planner, map_, lambda _: 99)[0]
    assert planner.is_finished
    assert [fault for step in steps for fault in faults(map_, step)] == []


class WillingArm(FollowedArm):
    """An arm that follows any table."""

    def __init__(self) -> None:
        pass

    def follow(self, joints: FloatArray, T_TF: FloatArray, angles_deg: FloatArray) -> FloatArray:
        assert len(T_TF) == len(angles_deg)
        return np.tile(joints, (len(T_TF), 1))

    def arrive(self, T_TF: FloatArray, angle_deg: float, before: FloatArray | None = None) -> FloatArray:
        assert T_TF.shape == (4, 4)
        assert np.isfinite(angle_deg)
        return np.zeros(6) if before is None else before


def test_with_an_arm_the_table_never_halts_since_it_would_turn_under_an_arm_that_stands() -> None:
    map_ = corridor()
    planner = begun(map_, 12, Receding(), arm=WillingArm())
    assert planner is not None
    kept: list[KeptStep] = []
    steps: list[Step] = []
    for _ in range(200):
        steps += tracked(planner, map_, lambda _: 99, ticks=1)[0]
        kept += planner.kept
        if planner.is_finished:
            break
    assert planner.is_finished
    assert kept
    assert not any(each.halts for each in kept)
    assert [fault for step in steps for fault in faults(map_, step)] == []


def test_a_wall_is_passed_by_a_pause_at_rest() -> None:
    map_ = blocks_map(30, 72, [(0, 14, 0, 35), (15, 29, 36, 71)])
    planner = begun_for_certain(map_, 8)
    steps, blocked = tracked(planner, map_, lambda _: 99)
    pauses = [step for step in steps if step.kind is Kind.PAUSE]
    assert blocked is None
    assert [step.start.location for step in pauses] == [14]
    assert all(step.start.is_at_rest and step.end.is_at_rest for step in pauses)
    assert planner.is_finished


def test_a_column_that_is_blocked_whole_is_named_and_the_table_rests_before_it() -> None:
    map_ = blocks_map(30, 72, [(12, 12, 0, 71)])
    planner = begun_for_certain(map_, 8)
    steps, blocked = tracked(planner, map_, lambda _: 99)
    assert blocked == Blocked(12)
    assert planner.state.is_at_rest
    assert planner.state.location == 11
    assert [fault for step in steps for fault in faults(map_, step)] == []


def test_a_location_ahead_of_the_window_is_refused() -> None:
    map_ = synthetic_map(MapFamily(), 0)
    planner = begun_for_certain(map_, 5)
    for k in range(1, 6):
        planner.revealed.reveal(map_.values[k])
    with pytest.raises(WindowError, match="location 6 is ahead of the window, which ends 5 locations ahead"):
        planner.revealed.reveal(map_.values[6])


def test_with_all_in_view_the_motion_costs_little_more_than_the_best() -> None:
    map_ = synthetic_map(MapFamily(forbidden=0.2), 1)
    planner = begun_for_certain(map_, 50)
    start_deg = planner.state.angle_deg
    steps, _ = tracked(planner, map_, lambda _: 999)
    problem = Problem(map_, STEP_S, start_angle_deg=start_deg)
    best = dynamic_programming(problem)
    assert isinstance(best, Plan)
    cost = path_cost(
        problem,
        np.array([start_deg, *(step.end.angle_deg for step in steps)]),
        np.array([0.0, *(step.end.speed_deg_s for step in steps)]),
        np.array([step.acceleration_deg_s2 for step in steps]),
        [Pause(s.start.location, s.start.angle_deg, s.end.angle_deg) for s in steps if s.kind is Kind.PAUSE],
    )
    assert best.cost.total <= cost.total <= 1.02 * best.cost.total
