"""The reason why a pose of the arm is forbidden, as one small code per pose.

The codes are stored in maps and files, so a published number never changes its meaning. They are in groups with reserve
between them: 0 allowed; 1 to 15 kinematics; 16 to 31 the value function; 32 and up collisions, one code for each pair
of bodies that can collide.
"""

from enum import IntEnum


class Reason(IntEnum):
    """Why a pose is forbidden; REACHED if it is allowed."""

    REACHED = 0
    OUT_OF_REACH = 1
    """The wrist center is closer or farther than upper arm and forearm can reach."""
    SINGULAR = 2
    """The angle of a joint is undefined: axes 4 and 6 coincide, or the wrist center is on axis 1 (or on axis 2)."""
    JOINT_1_LIMIT = 3
    JOINT_2_LIMIT = 4
    JOINT_3_LIMIT = 5
    JOINT_4_LIMIT = 6
    JOINT_5_LIMIT = 7
    JOINT_6_LIMIT = 8
    """Several joints may be beyond their limits; the one nearest to the base is named."""

    JOINT_1_SPEED = 9
    JOINT_2_SPEED = 10
    JOINT_3_SPEED = 11
    JOINT_4_SPEED = 12
    JOINT_5_SPEED = 13
    JOINT_6_SPEED = 14
    """Only between two steps of a joint path; a single pose has no speed."""

    WRIST_TURN = 15
    """Only between two steps of a joint path: the nearest turns of joints 4 and 6 rotate the flange by a full turn."""

    @property
    def label(self) -> str:
        """The name as text: `joint 6 limit`."""
        return self.name.lower().replace("_", " ")
