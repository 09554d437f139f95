"""The direction in which a wrist rotates the flange when its joints move proportionally between two solutions.

In the forearm's frame, the wrist rotates the flange by Rz(joint 4) Ry(joint 5) Rz(joint 6). Its unit quaternion
contains half of each angle, so a whole turn of a joint changes its sign. The product of the quaternions before and
after is positive if the flange takes the shorter direction. It is negative for the longer one.
"""

import math

from planner.kernel import kernel


@kernel
def turns_the_long_way(before_5: float, after_5: float, move_4: float, move_6: float) -> bool:
    """Return whether the flange turns by more than half a turn.

    Near the wrist singularity, joints 4 and 6 move in opposite directions. If each takes its nearest turn
    independently, both may move in the same direction: then the flange would rotate by a full turn.

    Args:
        before_5: joint 5 before the move, in radians.
        after_5: joint 5 after the move.
        move_4: travel of joint 4.
        move_6: travel of joint 6.
    """
    along = math.cos(0.5 * before_5) * math.cos(0.5 * after_5) * math.cos(0.5 * (move_4 + move_6))
    against = math.sin(0.5 * before_5) * math.sin(0.5 * after_5) * math.cos(0.5 * (move_4 - move_6))
    return along + against < 0.0
