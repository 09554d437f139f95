"""Assign robot poses and table angles to profiles: those latched at the same trigger.

The probe numbers its profiles and adds a time stamp. The robot adds a time stamp to each latched pose. The table does
not: `L` returns the last latched angle, without its time. So a reading belongs to the last trigger before it, if no
other trigger came during the reading. It must also agree with the known motion of the table; otherwise the table missed
that trigger, or detected a false one. A profile without a matching value is dropped; it never takes the value of
another one.
"""

from collections.abc import Callable, Collection, Sequence
from enum import Enum
from typing import NamedTuple

import numpy as np

from planner.arrays import FloatArray, IndexArray

# The interval for the planned speed, and the speed below which a lag is not visible.
_STEP_S, _SLOW_DEG_S = 0.005, 1.0
# Number of readings before and after a trigger that determine the table's deviation from its plan.
_NEIGHBORS = 7


class Trigger(NamedTuple):
    """A profile of the probe: its number and its time."""

    number: int
    time_s: float


class RobotLatch(NamedTuple):
    """Joints (deg) latched by the robot, and the time."""

    time_s: float
    joints_deg: FloatArray


class TableReading(NamedTuple):
    """A reply to `L`, received between `earliest_s` and `latest_s`."""

    earliest_s: float
    latest_s: float
    angle_deg: float


class Drop(Enum):
    """Why a profile has no pose."""

    ROBOT_MISSED = "the robot latched nothing"
    TABLE_UNREAD = "the next trigger came before the table's latch was read"
    TABLE_STRAY = "the latch of the table is from another trigger"


class Tolerances(NamedTuple):
    """Allowed differences between latches of the same trigger.

    Attributes:
        robot_s: time stamp of the robot minus that of the probe.
        table_deg: table angle minus planned angle, relative to the usual deviation from the plan.
    """

    robot_s: float = 0.001
    table_deg: float = 0.13


class Pairing(NamedTuple):
    """The complete triggers, and the reasons for the others.

    Attributes:
        numbers: `(n,)` numbers of the profiles with a pose, ascending.
        joints_deg: `(n, 6)`.
        angles_deg: `(n,)`.
        dropped: the others.
    """

    numbers: IndexArray
    joints_deg: FloatArray
    angles_deg: FloatArray
    dropped: dict[int, Drop]

    def only(self, numbers: Collection[int]) -> "Pairing":
        """Return the assignment for some of the triggers."""
        kept = np.isin(self.numbers, list(numbers))
        dropped = {number: why for number, why in self.dropped.items() if number in numbers}
        return Pairing(self.numbers[kept], self.joints_deg[kept], self.angles_deg[kept], dropped)


def pair(
    triggers: Sequence[Trigger],
    robot: Sequence[RobotLatch],
    table: Sequence[TableReading],
    planned_deg: Callable[[float], float],
    tolerances: Tolerances | None = None,
) -> Pairing:
    """Return the complete assignment.

    Args:
        triggers: profiles of the probe, in ascending order of time.
        robot: the joints latched by the robot.
        table: the replies to `L`.
        planned_deg: the planned angle of the table at a time.
        tolerances: allowed differences between latches of the same trigger.
    """
    tolerances = tolerances or Tolerances()
    joints = _robot_partners(triggers, robot, tolerances.robot_s)
    readings = _table_partners(triggers, table)
    stray = _strays(triggers, readings, planned_deg, tolerances.table_deg)
    dropped: dict[int, Drop] = {}
    for trigger in triggers:
        if trigger.number not in joints:
            dropped[trigger.number] = Drop.ROBOT_MISSED
        elif trigger.number not in readings:
            dropped[trigger.number] = Drop.TABLE_UNREAD
        elif trigger.number in stray:
            dropped[trigger.number] = Drop.TABLE_STRAY
    kept = [trigger.number for trigger in triggers if trigger.number not in dropped]
    return Pairing(
        np.array(kept, dtype=np.int64),
        np.array([joints[number] for number in kept]).reshape(-1, 6),
        np.array([readings[number] for number in kept], dtype=np.float64),
        dropped,
    )


def _robot_partners(
    triggers: Sequence[Trigger], robot: Sequence[RobotLatch], tolerance_s: float
) -> dict[int, FloatArray]:
    """Return the joints of each trigger with the robot's time stamp near its time; of two, the nearer one."""
    latches = sorted(robot, key=lambda latch: latch.time_s)
    stamps = np.array([latch.time_s for latch in latches])
    partners = {}
    for trigger in triggers:
        after = int(np.searchsorted(stamps, trigger.time_s))
        near = [k for k in (after - 1, after) if 0 <= k < len(latches)]
        nearest = min(near, key=lambda k: abs(stamps[k] - trigger.time_s), default=None)
        if nearest is not None and abs(stamps[nearest] - trigger.time_s) <= tolerance_s:
            partners[trigger.number] = latches[nearest].joints_deg
    return partners


def _table_partners(triggers: Sequence[Trigger], table: Sequence[TableReading]) -> dict[int, float]:
    """Return the first reading that certainly belongs to each trigger."""
    times = np.array([trigger.time_s for trigger in triggers])
    partners: dict[int, float] = {}
    for reading in table:
        before = int(np.searchsorted(times, reading.earliest_s, side="right"))
        if before > 0 and before == int(np.searchsorted(times, reading.latest_s, side="right")):
            partners.setdefault(triggers[before - 1].number, reading.angle_deg)
    return partners


def _strays(
    triggers: Sequence[Trigger],
    readings: dict[int, float],
    planned_deg: Callable[[float], float],
    tolerance_deg: float,
) -> set[int]:
    """Return the triggers whose reading has another deviation from the plan than the readings around it.

    The lag of this table behind its plan, beyond the one known to the caller, is determined from the readings.
    """
    read = [trigger for trigger in triggers if trigger.number in readings]
    off_deg = np.array([readings[trigger.number] - planned_deg(trigger.time_s) for trigger in read])
    speeds_deg_s = np.array(
        [
            (planned_deg(trigger.time_s + _STEP_S) - planned_deg(trigger.time_s - _STEP_S)) / (2.0 * _STEP_S)
            for trigger in read
        ]
    )
    off_deg = off_deg + _lag_s(off_deg, speeds_deg_s) * speeds_deg_s
    stray = set()
    for k, trigger in enumerate(read):
        around = off_deg[max(0, k - _NEIGHBORS) : k + _NEIGHBORS + 1]
        if abs(off_deg[k] - float(np.median(around))) > tolerance_deg:
            stray.add(trigger.number)
    return stray


def _lag_s(off_deg: FloatArray, speeds_deg_s: FloatArray) -> float:
    """Return the delay of the readings: the median of -deviation over speed, weighted by the speed."""
    fast = np.abs(speeds_deg_s) > _SLOW_DEG_S
    if not fast.any():
        return 0.0
    lags_s, weights = -off_deg[fast] / speeds_deg_s[fast], np.abs(speeds_deg_s[fast])
    order = np.argsort(lags_s)
    middle = np.searchsorted(np.cumsum(weights[order]), 0.5 * weights.sum())
    return float(lags_s[order][min(int(middle), len(order) - 1)])
