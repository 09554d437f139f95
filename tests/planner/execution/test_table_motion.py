from itertools import pairwise

import numpy as np
import pytest

from planner.execution.table_motion import PauseTimes, Phase, TableMotion
from planner.plans.plan import Plan
from planner.table.cost import PathCost
from planner.table.motion import Limits, roll_out
from tests.planner.run_examples import paused_run_input, short_run_input

LIMITS = Limits()


def test_every_location_is_met_at_its_time() -> None:
    plan = short_run_input().plan
    motion = TableMotion(plan, LIMITS)
    np.testing.assert_allclose(motion.column_times_s, plan.step_s * np.arange(len(plan.angles_deg)))
    np.testing.assert_allclose(motion.angles_at(motion.column_times_s), plan.angles_deg, atol=1e-9)


def test_a_pause_stops_turns_and_waits_for_the_probe() -> None:
    plan = paused_run_input().plan
    motion = TableMotion(plan, LIMITS, PauseTimes(retract_s=1.5, approach_s=2.0))
    pause = [leg for leg in motion.legs if leg.phase in {Phase.RETRACT, Phase.ROTATE, Phase.APPROACH}]
    assert [leg.phase for leg in pause] == [Phase.RETRACT, Phase.ROTATE, Phase.APPROACH]
    assert pause[0].duration_s == 1.5
    assert pause[2].duration_s == 2.0
    assert pause[1].state_at(pause[1].end_s).angle_deg == plan.angles_deg[10]
    assert motion.column_times_s[10] == pause[2].end_s
    np.testing.assert_allclose(motion.angles_at(motion.column_times_s), plan.angles_deg, atol=1e-6)


def test_the_legs_have_no_gap() -> None:
    for run_input in (short_run_input(), paused_run_input()):
        legs = TableMotion(run_input.plan, LIMITS).legs
        for before, after in pairwise(legs):
            assert after.start_s == pytest.approx(before.end_s)
            assert after.start.angle_deg == pytest.approx(before.state_at(before.end_s).angle_deg)


def test_a_plan_that_begins_and_ends_in_motion_gets_a_run_up_and_comes_back() -> None:
    angles, speeds = roll_out(90.0, 20.0, np.zeros(5), 0.1)
    motion = TableMotion(Plan("", "", 0.1, angles, speeds, np.zeros(5), PathCost(0.0, 0.0, 0.0)), LIMITS)
    assert motion.legs[0].phase is Phase.RUN_UP
    assert motion.start_s == pytest.approx(-0.2)
    assert motion.start_deg == pytest.approx(88.0)
    assert motion.state_at(0.0) == pytest.approx((90.0, 20.0))
    assert motion.state_at(motion.end_s) == (angles[-1], 0.0)
