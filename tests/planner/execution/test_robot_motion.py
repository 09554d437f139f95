import numpy as np

from planner.arrays import FloatArray
from planner.execution.robot_motion import robot_motion, turning_time_s
from planner.execution.table_motion import PauseTimes, Phase, TableMotion
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


def test_in_a_pause_no_joint_turns_faster_than_it_can() -> None:
    plan, speeds_deg_s = paused_run_input().plan, np.array([328.0, 300.0, 375.0, 375.0, 375.0, 600.0])
    joints_deg = np.zeros((LOCATIONS, 6))
    joints_deg[10:, 3], joints_deg[10:, 5] = 370.0, -700.0
    needed_s = turning_time_s(plan, joints_deg, speeds_deg_s)
    assert needed_s == 700.0 / 600.0
    # The table alone turns within a second.
    assert _top_speeds_deg_s(TableMotion(plan, Limits(200.0, 1000.0)), joints_deg)[5] > 600.0
    motion = TableMotion(plan, Limits(200.0, 1000.0), PauseTimes(rotate_s=needed_s))
    assert (_top_speeds_deg_s(motion, joints_deg) <= speeds_deg_s * (1.0 + 1e-9)).all()


def _top_speeds_deg_s(motion: TableMotion, joints_deg: FloatArray) -> FloatArray:
    robot = robot_motion(motion, joints_deg)
    speeds_deg_s = np.abs(np.diff(robot.joints_deg, axis=0)) / np.diff(robot.times_s)[:, np.newaxis]
    return np.asarray(speeds_deg_s.max(axis=0))


def test_a_plan_without_a_pause_needs_no_time_to_turn() -> None:
    assert turning_time_s(short_run_input().plan, JOINTS, np.ones(6)) == 0.0
