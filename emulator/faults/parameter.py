"""A number that a command of the control channel, or a fault, takes."""

from typing import NamedTuple


class Parameter(NamedTuple):
    """A number, and the closed interval that it must lie in; `optional`: it may be left out; `whole`: no fraction."""

    name: str
    least: float
    most: float
    help: str
    optional: bool = False
    whole: bool = False

    @property
    def allowed(self) -> str:
        """What it may be, in words."""
        if self.whole:
            return f"a whole number from {self.least:.0f} to {self.most:.0f}"
        return f"a number from {self.least:g} to {self.most:g}"

    def accepts(self, value: object) -> bool:
        """Return whether a value from outside is such a number."""
        if not isinstance(value, int | float) or isinstance(value, bool) or not self.least <= value <= self.most:
            return False
        return not self.whole or value == int(value)
