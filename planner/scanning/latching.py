"""Which robot pose and which table angle belong to which profile: what was latched on the same trigger.

The probe numbers its profiles and stamps them with their time. The robot stamps each pose that it latches. The table
does not: `L` says what was latched last, whenever that was. So a reading belongs to the last trigger before it, as long
as no other trigger came while it was on its way; and it must agree with the motion that the table is known to make, or
the table has missed that trigger, or heard one that was none. A profile that misses its partner is dropped; it never
takes another's.
"""

from collections.abc import Callable, Collection, Sequence
from enum import Enum
from typing import NamedTuple

import numpy as np

from planner.arrays import FloatArray, IndexArray

# Over which the planned speed is taken, and below which it shows no lag.
_STEP_S, _SLOW_DEG_S = 0.005, 1.0
# How many readings before and after tell how far the table is off its plan at a trigger.
_NEIGHBORS = 7


class Trigger(NamedTuple):
    """A profile that the probe has taken: its number and its time."""

    number: int
    time_s: float


class RobotLatch(NamedTuple):
    """Joints (deg) that the robot has latched, and when."""

    time_s: float
    joints_deg: FloatArray


class TableReading(NamedTuple):
    """An answer to `L`: it was given between `earliest_s` and `latest_s`."""

    earliest_s: float
    latest_s: float
    angle_deg: float


class Drop(Enum):
    """Why a profile has no pose."""

    ROBOT_MISSED = "the robot latched nothing"
    TABLE_UNREAD = "the next trigger came before the table's latch was read"
    TABLE_STRAY = "what the table latched was not this trigger"


class Tolerances(NamedTuple):
    """What latches of the same trigger may differ by.

    Attributes:
        robot_s: The robot's time stamp against the probe's.
        table_deg: The table's angle against its plan, beside how far it is off the plan all the while.
    """

    robot_s: float = 0.001
    table_deg: float = 0.13


class Pairing(NamedTuple):
    """The triggers that are complete, and why the others are not.

    Attributes:
        numbers: `(n,)` of the profiles that have a pose, ascending.
        joints_deg: `(n, 6)`.
        angles_deg: `(n,)`.
        dropped: The others.
    """

    numbers: IndexArray
    joints_deg: FloatArray
    angles_deg: FloatArray
    dropped: dict[int, Drop]

    def only(self, numbers: Collection[int]) -> "Pairing":
        """Return the pairing of some of the triggers."""
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
    """Return what belongs together.

    Args:
        triggers: The probe's profiles, by ascending time.
        robot: What the robot has latched.
        table: The answers to `L`.
        planned_deg: The angle at which the table is planned to be at a time.
        tolerances: What latches of the same trigger may differ by.
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
    """Return the joints of each trigger that the robot stamped with its time; of two such, the nearer."""
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
    """Return the first reading that belongs to each trigger for certain."""
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
    """Return the triggers whose reading is off the plan by another amount than the readings around it.

    How far this table lags behind its plan, more than the caller knows, is taken from the readings themselves.
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
    """Return by how much readings are late: the median of -off over speed, weighted by the speed."""
    fast = np.abs(speeds_deg_s) > _SLOW_DEG_S
    if not fast.any():
        return 0.0
    lags_s, weights = -off_deg[fast] / speeds_deg_s[fast], np.abs(speeds_deg_s[fast])
    order = np.argsort(lags_s)
    middle = np.searchsorted(np.cumsum(weights[order]), 0.5 * weights.sum())
    return float(lags_s[order][min(int(middle), len(order) - 1)])
