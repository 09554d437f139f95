"""A number that a command of the control channel, or a fault, takes."""

from typing import NamedTuple


class Parameter(NamedTuple):
    """A number, and the closed interval that it must lie in; an optional one may be left out."""

    name: str
    least: float
    most: float
    help: str
    optional: bool = False

    @property
    def allowed(self) -> str:
        """What it may be, in words."""
        return f"a number from {self.least:g} to {self.most:g}"

    def accepts(self, value: object) -> bool:
        """Return whether a value from outside is such a number."""
        return isinstance(value, int | float) and not isinstance(value, bool) and self.least <= value <= self.most
