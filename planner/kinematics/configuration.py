"""The eight configurations in which the arm can hold one pose, and how to tell them from the joints."""

import math
import re
from enum import IntEnum

import numpy as np

from planner.arrays import FloatArray, IndexArray
from planner.errors import ConfigurationNameError
from planner.kinematics.arm import Arm


class Configuration(IntEnum):
    """An arm configuration; its value is its slot in every array of solutions: 4 RIGHTY + 2 BELOW + NOFLIP."""

    LEFTY_ABOVE_FLIP = 0
    LEFTY_ABOVE_NOFLIP = 1
    LEFTY_BELOW_FLIP = 2
    LEFTY_BELOW_NOFLIP = 3
    RIGHTY_ABOVE_FLIP = 4
    RIGHTY_ABOVE_NOFLIP = 5
    RIGHTY_BELOW_FLIP = 6
    RIGHTY_BELOW_NOFLIP = 7

    @property
    def label(self) -> str:
        """The name as people write it: `LEFTY-ABOVE-NOFLIP`."""
        return self.name.replace("_", "-")

    @property
    def lefty(self) -> bool:
        """The arm reaches forward: joint 1 faces the wrist."""
        return self < 4

    @property
    def above(self) -> bool:
        """The elbow is above the line from shoulder to wrist."""
        return not self & 2

    @property
    def flip(self) -> bool:
        """Joint 5 is negative."""
        return not self & 1

    @classmethod
    def parse(cls, text: str) -> "Configuration":
        """Return the configuration named by three words in any case, parted by dashes, spaces or commas.

        Raises:
            ConfigurationNameError: The text names none.
        """
        name = "_".join(re.split(r"[-_,\s]+", text.strip().upper()))
        try:
            return cls[name]
        except KeyError:
            raise ConfigurationNameError(
                f"{text!r} is no arm configuration; write LEFTY or RIGHTY, ABOVE or BELOW, FLIP or NOFLIP,"
                " for example LEFTY-ABOVE-NOFLIP"
            ) from None


def configurations(arm: Arm, joints: FloatArray) -> IndexArray:
    """Return the slot `(n,)` of the configuration that each row of joints `(n, 6)`, in radians, is in.

    LEFTY when the wrist centre lies ahead of axis 1; ABOVE when the elbow bends down from the stretched arm (up, for
    RIGHTY); FLIP when joint 5 is negative. On a boundary, where two configurations meet, LEFTY and NOFLIP win.
    """
    # Mirrored twists turn joints 2 and 3 the other way round.
    sense = -math.copysign(1.0, arm.alpha_deg[0])
    upper, forearm = sense * joints[:, 1], sense * (joints[:, 1] + joints[:, 2])
    reach_mm = arm.a_mm[0] + arm.a_mm[1] * np.cos(upper) + arm.a_mm[2] * np.cos(forearm) + arm.d_mm[3] * np.sin(forearm)
    stretched = math.atan2(arm.d_mm[3], arm.a_mm[2])
    elbow_bends_down = np.sin(sense * joints[:, 2] - stretched) > 0.0
    righty = reach_mm < 0.0
    below = elbow_bends_down == righty
    noflip = np.sin(joints[:, 4]) >= 0.0
    return np.asarray(4 * righty + 2 * below + noflip, dtype=np.int64)
