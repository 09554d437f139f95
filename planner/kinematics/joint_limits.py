"""Check joint limits and joint speeds along a joint path from any source."""

from collections.abc import Collection
from enum import Enum
from typing import NamedTuple

import numpy as np

from planner.arrays import FloatArray
from planner.kinematics.arm import Arm

# Files have nine decimals: an excess of this size over a limit is rounding.
_ROUNDING_DEG = 1e-6
_HALF_TURN_DEG = 180.0


class FaultKind(Enum):
    """The kind of a fault of a joint: its text takes the value and the limit."""

    UNKNOWN = "has no angle"
    LIMIT = "is at {value:.1f} deg, beyond its limit of {limit:g} deg"
    TURN = "moves by {value:.1f} deg from the previous location, more than half a turn"
    SPEED = "moves at {value:.1f} deg/s from the previous location, faster than its limit of {limit:g} deg/s"


class JointFault(NamedTuple):
    """The first violation along a path.

    Attributes:
        location: index of the location, from 0; for a speed, the location at the end of the step.
        joint: number of the joint, from 1.
        kind: kind of the fault.
        value: the angle in deg, the travel in deg or the speed in deg/s, signed.
        limit: maximum of `value`, or its minimum for a lower joint limit.
    """

    location: int
    joint: int
    kind: FaultKind
    value: float
    limit: float

    def __str__(self) -> str:
        what = self.kind.value.format(value=self.value, limit=self.limit)
        return f"at location {self.location} joint {self.joint} {what}"


def first_joint_fault(
    arm: Arm, joints_deg: FloatArray, step_s: float, paused_steps: Collection[int] = ()
) -> JointFault | None:
    """Return the first violation of the arm's joint limits or speeds along a path, or None.

    The turns of the joints count: joint 6 at 370 degrees is not at 10. A step is one motion in the shorter direction,
    so it moves no joint by more than half a turn. Several violations at a location are in the order of `FaultKind`,
    then from the base to the flange.

    Args:
        arm: limits and speeds.
        joints_deg: (n + 1, 6) at the scan locations.
        step_s: time from one location to the next.
        paused_steps: steps in which the probe retracts and the arm has sufficient time.
    """
    lower_deg, upper_deg = np.array(arm.lower_deg), np.array(arm.upper_deg)
    ways_deg = np.diff(joints_deg, axis=0, prepend=joints_deg[:1])
    ways_deg[[step + 1 for step in paused_steps]] = 0.0
    speeds_deg_s, top_deg_s = ways_deg / step_s, np.array(arm.max_speed_deg_s)
    nearer_deg = np.where(joints_deg < lower_deg, lower_deg, upper_deg)
    half_turn_deg = np.full_like(joints_deg, _HALF_TURN_DEG)
    checks = (
        (FaultKind.UNKNOWN, ~np.isfinite(joints_deg), joints_deg, nearer_deg),
        (
            FaultKind.LIMIT,
            (joints_deg < lower_deg - _ROUNDING_DEG) | (joints_deg > upper_deg + _ROUNDING_DEG),
            joints_deg,
            nearer_deg,
        ),
        (FaultKind.TURN, np.abs(ways_deg) > _HALF_TURN_DEG + _ROUNDING_DEG, ways_deg, half_turn_deg),
        (
            FaultKind.SPEED,
            np.abs(ways_deg) > top_deg_s * step_s + _ROUNDING_DEG,
            speeds_deg_s,
            np.broadcast_to(top_deg_s, joints_deg.shape),
        ),
    )
    faults = [
        JointFault(int(location), int(joint) + 1, kind, float(values[location, joint]), float(limits[location, joint]))
        for kind, faulty, values, limits in checks
        for location, joint in np.argwhere(faulty)[:1]
    ]
    return min(faults, key=lambda fault: fault.location, default=None)
