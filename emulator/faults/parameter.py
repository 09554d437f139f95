"""A number that a control command or a fault takes."""

from typing import NamedTuple


class Parameter(NamedTuple):
    """A number, and its allowed closed interval. `optional`: it may be omitted; `whole`: it has no fraction."""

    name: str
    least: float
    most: float
    help: str
    optional: bool = False
    whole: bool = False

    @property
    def allowed(self) -> str:
        """The allowed values, as text."""
        if self.whole:
            return f"a whole number from {self.least:.0f} to {self.most:.0f}"
        return f"a number from {self.least:g} to {self.most:g}"

    def accepts(self, value: object) -> bool:
        """Return whether an external value is an allowed number."""
        if not isinstance(value, int | float) or isinstance(value, bool) or not self.least <= value <= self.most:
            return False
        return not self.whole or value == int(value)
