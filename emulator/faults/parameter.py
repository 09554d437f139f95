"""A number that a command of the control channel, or a fault, takes."""

import reprlib
from typing import NamedTuple

_SHOWN_CHARACTERS = 60
_SHOWN_BITS = 256


class _Brief(reprlib.Repr):
    """A `repr` that stays short, however deep, long or large the value is."""

    def __init__(self) -> None:
        super().__init__()
        self.maxlevel = 2
        self.maxstring = self.maxlong = self.maxother = _SHOWN_CHARACTERS

    def repr_int(self, x: int, level: int) -> str:
        """Return an integer, or its size: Python refuses to write one of more than some thousand digits."""
        return f"an integer of {x.bit_length()} bits" if x.bit_length() > _SHOWN_BITS else super().repr_int(x, level)


brief = _Brief().repr
"""Return a value from outside as a message shows it; whatever a parser of JSON or TOML returns, this does not fail."""


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
