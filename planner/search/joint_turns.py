"""The turns of an arm's joints, and their change in a move between two columns.

The map has no memory, but an arm has: joints 4 and 6 wind up along a path, and joint speeds limit the moves between two
columns. A move changes each joint in the shorter direction, so it also changes the turn of the joint. It is barred if
it exceeds a joint's maximum speed, or if it ends beyond a joint limit. It is also barred if the shorter directions of
joints 4 and 6 are not the shorter direction of the flange.
"""

from itertools import product
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from planner.arrays import BoolArray, FloatArray, IndexArray
from planner.kernel import kernel
from planner.kinematics.arm import Arm
from planner.kinematics.wrist_turn import turns_the_long_way

JOINTS = 6
TURN = 2.0 * np.pi
# The direction is not certain for a joint that moves by half a turn: rounding would decide.
_MOST_RAD = np.pi - 1e-6

_CHANGES = np.array(tuple(product((-1, 0, 1), repeat=JOINTS)))

# Codes below that of the last joint's speed, and the number of kinds of bars.
WRIST_BAR = -1 - JOINTS
BARS = 2 * JOINTS + 1

TurnsArray = npt.NDArray[np.int16]


class Margin(NamedTuple):
    """Margins of a motion from the limits of the joints.

    Attributes:
        limit_deg: distance from each joint limit.
        speed_share: share of each joint's maximum speed that may be used.
    """

    limit_deg: float
    speed_share: float


class Turns(NamedTuple):
    """The combinations of turns that a search distinguishes, as arrays for the kernels.

    A change of turns has a code: per joint -1, 0 or 1 turns, plus 1, as digits in base 3.

    Attributes:
        turns: (n_turns, 6) whole turns added to each joint.
        after: (n_turns, 3**6) the combination after a change of turns; -1 if there is none.
        lower_rad: (6,) lower joint limits.
        upper_rad: (6,) upper joint limits.
        most_rad: (6,) maximum moves in a step.
    """

    turns: IndexArray
    after: TurnsArray
    lower_rad: FloatArray
    upper_rad: FloatArray
    most_rad: FloatArray


def lay_out_turns(arm: Arm, joints: FloatArray, step_s: float, margin: Margin) -> Turns:
    """Return the combinations of turns for which joints (..., 6), in radians, can be within their limits.

    There is none if a joint is beyond its limits everywhere.
    """
    lower, upper = arm.limits
    keep = np.minimum(np.radians(margin.limit_deg), 0.5 * (upper - lower))
    lower, upper = lower + keep, upper - keep
    every = joints.reshape(-1, JOINTS)
    every = every[np.isfinite(every).all(axis=1)]
    if not len(every):
        every = np.full((1, JOINTS), np.inf)
    first, last = np.ceil((lower - every.max(axis=0)) / TURN), np.floor((upper - every.min(axis=0)) / TURN)
    ranges = [np.arange(int(a), int(b) + 1) for a, b in zip(first, last, strict=True)]
    turns = np.stack(np.meshgrid(*ranges, indexing="ij"), axis=-1).reshape(-1, JOINTS)
    is_after = (turns[:, np.newaxis, np.newaxis] + _CHANGES[:, np.newaxis] == turns).all(axis=-1)
    return Turns(
        turns=turns,
        after=np.where(is_after.any(axis=-1), is_after @ np.arange(len(turns)), -1).astype(np.int16),
        lower_rad=lower,
        upper_rad=upper,
        most_rad=np.minimum(np.radians(arm.max_speed_deg_s) * step_s * margin.speed_share, _MOST_RAD),
    )


@kernel
def turn_change(turns: Turns, before: FloatArray, after: FloatArray) -> int:
    """Return the code of the change of turns from joints (6,) to joints (6,).

    -1 - j if joint j is too fast, WRIST_BAR if the flange would take the longer direction.
    """
    code, move_4, move_6 = 0, 0.0, 0.0
    for j in range(JOINTS):
        moved = after[j] - before[j]
        change = -np.rint(moved / TURN)
        moved += TURN * change
        if not abs(moved) <= turns.most_rad[j]:
            return -1 - j
        code = 3 * code + int(change) + 1
        move_4, move_6 = moved if j == 3 else move_4, moved
    return WRIST_BAR if turns_the_long_way(before[4], after[4], move_4, move_6) else code


@kernel
def is_within_limits(turns: Turns, combination: int, joints: FloatArray) -> bool:
    """Return whether joints (6,) with a combination of turns are within their limits."""
    for j in range(JOINTS):
        angle = joints[j] + TURN * turns.turns[combination, j]
        if not turns.lower_rad[j] <= angle <= turns.upper_rad[j]:
            return False
    return True


@kernel
def count_bar(turns: Turns, combination: int, before: FloatArray, after: FloatArray, bars: IndexArray) -> None:
    """Count the bars (BARS,) of a move between joints (6,): six limits, six speeds, the flange's direction."""
    code = turn_change(turns, before, after)
    if code < 0:
        bars[JOINTS - 1 - code] += 1
        return
    for j in range(JOINTS):
        change = -np.rint((after[j] - before[j]) / TURN)
        angle = after[j] + TURN * (turns.turns[combination, j] + change)
        if not turns.lower_rad[j] <= angle <= turns.upper_rad[j]:
            bars[j] += 1


@kernel
def fitting(turns: Turns, joints: FloatArray) -> BoolArray:
    """Return, per combination of turns, which of joints (m, 6) are within their limits: (n_turns, m)."""
    result = np.empty((len(turns.turns), len(joints)), dtype=np.bool_)
    for c in range(len(turns.turns)):
        for m in range(len(joints)):
            result[c, m] = is_within_limits(turns, c, joints[m])
    return result
