"""The motion of the robot in a run: the arm's joints at the times of the table's motion."""

from typing import NamedTuple

import numpy as np

from planner.arrays import FloatArray
from planner.execution.table_motion import Phase, TableMotion
from planner.plans.plan import Plan


class RobotMotion(NamedTuple):
    """The joint path over time; between two samples it is linear.

    Attributes:
        times_s: (m,) ascending, in the time of the table's motion.
        joints_deg: (m, 6).
        columns: (m,) the scan location of each sample.
        phases: (m,) what follows the sample. In a pause, the robot's own program retracts the probe along its beam and
            turns to the joints of the next location.
    """

    times_s: FloatArray
    joints_deg: FloatArray
    columns: tuple[int, ...]
    phases: tuple[Phase, ...]

    def joints_at(self, time_s: float) -> FloatArray:
        """Return the (6,) joints at a time, as an ideal robot latches them at a trigger."""
        return np.array([np.interp(time_s, self.times_s, self.joints_deg[:, j]) for j in range(6)])


def turning_time_s(plan: Plan, joints_deg: FloatArray, max_speeds_deg_s: FloatArray) -> float:
    """Return the maximum time that the arm needs to turn in any pause of a plan.

    Args:
        plan: the motion of the table.
        joints_deg: (n + 1, 6) the arm's joints at each scan location.
        max_speeds_deg_s: (6,) maximum joint speeds.
    """
    times_s = [np.abs(joints_deg[step + 1] - joints_deg[step]) / max_speeds_deg_s for step, *_ in plan.pauses]
    return float(np.max(times_s, initial=0.0))


def robot_motion(motion: TableMotion, joints_deg: FloatArray) -> RobotMotion:
    """Return the joint path of a run.

    Args:
        motion: the motion of the table.
        joints_deg: (n + 1, 6) the arm's joints at each scan location.
    """
    samples = [(0.0, 0, Phase.SCAN)]
    for leg in motion.legs:
        if leg.phase is Phase.SCAN or leg.phase is Phase.APPROACH:
            samples.append((leg.end_s, leg.column + 1, Phase.SCAN))
        elif leg.phase is Phase.WAIT:
            samples.append((leg.end_s, leg.column, Phase.SCAN))
        elif leg.phase is Phase.RETRACT:
            samples[-1] = (leg.start_s, leg.column, Phase.RETRACT)
        elif leg.phase is Phase.ROTATE:
            samples += [(leg.start_s, leg.column, Phase.ROTATE), (leg.end_s, leg.column + 1, Phase.APPROACH)]
    times, columns, phases = zip(*samples, strict=True)
    return RobotMotion(np.array(times), joints_deg[list(columns)], columns, phases)
