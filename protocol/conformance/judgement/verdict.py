"""Results of a case: measurements with their ranges, and a verdict."""

from dataclasses import dataclass
from enum import StrEnum
from math import inf


class Verdict(StrEnum):
    """How a case ended, from best to worst."""

    PASS = "pass"  # noqa: S105  # no password
    SKIPPED = "skipped"
    MARGINAL = "marginal"
    FAIL = "fail"
    ERROR = "error"


MARGIN = 0.1
"""A measurement within this share of its range, from either end, is marginal."""

_ROUNDING = 1e-9
"""Rounding error of a decimal that lies exactly at the end of its range."""


class NonconformityError(Exception):
    """The table violates the clause. The message states what it did instead."""


class InapplicableError(Exception):
    """A case cannot be run under the present conditions. The message states what is missing."""


def require(condition: bool, otherwise: str) -> None:
    """Raise NonconformityError unless the condition holds."""
    if not condition:
        raise NonconformityError(otherwise)


@dataclass(frozen=True)
class Measurement:
    """A measured quantity and its allowed closed range. An end that is None is open."""

    name: str
    value: float
    unit: str
    least: float | None = None
    most: float | None = None

    @property
    def verdict(self) -> Verdict:
        """Pass, or marginal near an end of the range, or fail outside of it."""
        low, high, width = self._range
        if not low - _ROUNDING <= self.value <= high + _ROUNDING:
            return Verdict.FAIL
        near = self.value - low < MARGIN * width or high - self.value < MARGIN * width
        return Verdict.MARGINAL if near and width > 0 else Verdict.PASS

    @property
    def margin(self) -> float:
        """Distance from the nearest end of the range, as a share of its width; negative outside of the range.

        A range without width has no margin: infinity for a value within it, minus infinity for others.
        """
        low, high, width = self._range
        distance = min(self.value - low, high - self.value)
        if width > 0:
            return distance / width
        return inf if distance >= -_ROUNDING else -inf

    @property
    def _range(self) -> tuple[float, float, float]:
        """Both ends, and the width. With one open end, the width is the absolute value of the other end."""
        low = -inf if self.least is None else self.least
        high = inf if self.most is None else self.most
        width = high - low
        return low, high, width if width < inf else abs(low if self.most is None else high)

    def __str__(self) -> str:
        if self.least is None:
            allowed = f"at most {self.most:.6g}"
        elif self.most is None:
            allowed = f"at least {self.least:.6g}"
        else:
            allowed = f"{self.least:.6g} to {self.most:.6g}"
        return f"{self.name} {self.value:.5g} {self.unit} (allowed: {allowed})"
