"""The table's motion: one constant acceleration from each scan location to the next, Eq. (3) and (4)."""

from typing import NamedTuple

import numpy as np

from planner.arrays import FloatArray
from planner.kernel import kernel


class Limits(NamedTuple):
    """The limits of the table; the defaults are those of the paper's table and controller."""

    speed_deg_s: float = 40.0
    acceleration_deg_s2: float = 100.0


class Motion(NamedTuple):
    """A motion along n steps that satisfies Eq. (3) and (4).

    Attributes:
        angles_deg: (n + 1,) unwrapped angle at each column.
        speeds_deg_s: (n + 1,) speed there.
        accelerations_deg_s2: (n,) acceleration of each step.
    """

    angles_deg: FloatArray
    speeds_deg_s: FloatArray
    accelerations_deg_s2: FloatArray


@kernel
def next_speed(speed_deg_s: float, acceleration_deg_s2: float, step_s: float) -> float:
    """Eq. (3): the speed one step later."""
    return speed_deg_s + acceleration_deg_s2 * step_s


@kernel
def next_angle(angle_deg: float, speed_deg_s: float, acceleration_deg_s2: float, step_s: float) -> float:
    """Eq. (4): the angle one step later, from the speed at the *start* of the step."""
    return angle_deg + speed_deg_s * step_s + 0.5 * acceleration_deg_s2 * step_s * step_s


@kernel
def limited_acceleration(
    speed_deg_s: float, acceleration_deg_s2: float, step_s: float, speed_limit_deg_s: float
) -> float:
    """Return the acceleration, reduced if the next speed would otherwise exceed the speed limit."""
    speed = next_speed(speed_deg_s, acceleration_deg_s2, step_s)
    if speed > speed_limit_deg_s:
        return (speed_limit_deg_s - speed_deg_s) / step_s
    if speed < -speed_limit_deg_s:
        return (-speed_limit_deg_s - speed_deg_s) / step_s
    return acceleration_deg_s2


@kernel
def swept_angles(
    angle_deg: float, speed_deg_s: float, acceleration_deg_s2: float, step_s: float
) -> tuple[float, float]:
    """Return the minimum and maximum angle of one step; a table that reverses in it moves beyond both ends."""
    end_deg = next_angle(angle_deg, speed_deg_s, acceleration_deg_s2, step_s)
    lowest, highest = min(angle_deg, end_deg), max(angle_deg, end_deg)
    if speed_deg_s * next_speed(speed_deg_s, acceleration_deg_s2, step_s) < 0.0:
        turning_deg = angle_deg - 0.5 * speed_deg_s * speed_deg_s / acceleration_deg_s2
        lowest, highest = min(lowest, turning_deg), max(highest, turning_deg)
    return lowest, highest


@kernel
def roll_out(
    angle_deg: float, speed_deg_s: float, accelerations_deg_s2: FloatArray, step_s: float
) -> tuple[FloatArray, FloatArray]:
    """Apply Eq. (3) and (4) from a start state.

    Returns:
        The (n + 1,) angles and the (n + 1,) speeds for n accelerations.
    """
    count = len(accelerations_deg_s2)
    angles, speeds = np.empty(count + 1), np.empty(count + 1)
    angles[0], speeds[0] = angle_deg, speed_deg_s
    for k in range(count):
        angles[k + 1] = next_angle(angles[k], speeds[k], accelerations_deg_s2[k], step_s)
        speeds[k + 1] = next_speed(speeds[k], accelerations_deg_s2[k], step_s)
    return angles, speeds


@kernel
def motion_through_angles(
    angles_deg: FloatArray, start_speed_deg_s: float, step_s: float
) -> tuple[FloatArray, FloatArray]:
    """Solve Eq. (3) and (4) inversely: the one motion with the given angles.

    Args:
        angles_deg: (n + 1,) angles.
        start_speed_deg_s: speed at the first of them.
        step_s: time from one to the next.

    Returns:
        The (n + 1,) speeds and the (n,) accelerations.
    """
    count = len(angles_deg) - 1
    speeds, accelerations = np.empty(count + 1), np.empty(count)
    speeds[0] = start_speed_deg_s
    for k in range(count):
        mean_speed = (angles_deg[k + 1] - angles_deg[k]) / step_s
        accelerations[k] = 2.0 * (mean_speed - speeds[k]) / step_s
        speeds[k + 1] = next_speed(speeds[k], accelerations[k], step_s)
    return speeds, accelerations
