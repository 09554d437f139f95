import numpy as np

from planner.execution.robot_motion import robot_motion
from planner.execution.table_motion import Phase, TableMotion
from planner.table.motion import Limits
from tests.planner.run_examples import LOCATIONS, paused_run_input, short_run_input

JOINTS = np.arange(6.0 * LOCATIONS).reshape(LOCATIONS, 6)


def test_the_robot_is_at_each_location_when_the_table_is() -> None:
    motion = TableMotion(short_run_input().plan, Limits())
    robot = robot_motion(motion, JOINTS)
    np.testing.assert_allclose(robot.times_s, motion.column_times_s)
    for column, time_s in enumerate(motion.column_times_s):
        np.testing.assert_allclose(robot.joints_at(float(time_s)), JOINTS[column])


def test_between_two_locations_it_moves_in_proportion() -> None:
    robot = robot_motion(TableMotion(short_run_input().plan, Limits()), JOINTS)
    np.testing.assert_allclose(robot.joints_at(0.25), 0.5 * (JOINTS[2] + JOINTS[3]))


def test_in_a_pause_it_waits_until_the_table_has_turned() -> None:
    motion = TableMotion(paused_run_input().plan, Limits())
    robot = robot_motion(motion, JOINTS)
    turning = next(leg for leg in motion.legs if leg.phase is Phase.ROTATE)
    np.testing.assert_allclose(robot.joints_at(turning.start_s), JOINTS[9])
    np.testing.assert_allclose(robot.joints_at(turning.end_s), JOINTS[10])
    assert (np.diff(robot.times_s) > 0.0).all()
    assert [phase for phase in robot.phases if phase is not Phase.SCAN] == [Phase.RETRACT, Phase.ROTATE, Phase.APPROACH]
