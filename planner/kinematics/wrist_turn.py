"""Which way round a wrist turns the flange when its joints move from one solution to another, in proportion.

Within the forearm's frame the wrist turns the flange by Rz(joint 4) Ry(joint 5) Rz(joint 6). Its unit quaternion holds
half of each angle, so a whole turn of a joint changes its sign. The product of the quaternions before and after is thus
positive where the flange goes the shorter way round, and negative where it goes the longer way.
"""

import math

from planner.kernel import kernel


@kernel
def turns_the_long_way(before_5: float, after_5: float, move_4: float, move_6: float) -> bool:
    """Return whether the flange turns by more than half a turn.

    Near the wrist singularity joints 4 and 6 swing against each other. Where each takes the nearest turn on its own,
    both may swing the same way: the flange would spin once around.

    Args:
        before_5: Joint 5 before the move, in radians.
        after_5: Joint 5 after it.
        move_4: By how much joint 4 moves.
        move_6: By how much joint 6 moves.
    """
    along = math.cos(0.5 * before_5) * math.cos(0.5 * after_5) * math.cos(0.5 * (move_4 + move_6))
    against = math.sin(0.5 * before_5) * math.sin(0.5 * after_5) * math.cos(0.5 * (move_4 - move_6))
    return along + against < 0.0
