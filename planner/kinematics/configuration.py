"""The eight configurations of the arm for one pose."""

import re
from enum import IntEnum

from planner.errors import ConfigurationNameError


class Configuration(IntEnum):
    """An arm configuration. Its value is its slot in every array of solutions: 4 RIGHTY + 2 BELOW + NOFLIP."""

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
        """The name in text form: `LEFTY-ABOVE-NOFLIP`."""
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
        """Return the configuration named by three words in any case, separated by dashes, spaces or commas.

        Raises:
            ConfigurationNameError: the text does not name a configuration.
        """
        name = "_".join(re.split(r"[-_,\s]+", text.strip().upper()))
        try:
            return cls[name]
        except KeyError:
            raise ConfigurationNameError(
                f"{text!r} is not an arm configuration; use LEFTY or RIGHTY, ABOVE or BELOW, FLIP or NOFLIP,"
                " for example LEFTY-ABOVE-NOFLIP"
            ) from None
