"""A gear ratio as the exact fraction of its numbers of teeth: 2197/27 or 4989/10, not 81.37037."""

import math
from fractions import Fraction


def simplest_fraction(value: float) -> Fraction:
    """Return the fraction with the smallest denominator among those whose nearest float is `value` (> 0).

    So a float gives the fraction from which it was computed: 2197 / 27 gives 2197/27, and 498.9 gives 4989/10.
    """
    exact = Fraction(value)
    below, above = Fraction(math.nextafter(value, 0.0)), Fraction(math.nextafter(value, math.inf))
    return _simplest_between((below + exact) / 2, (exact + above) / 2)


def _simplest_between(low: Fraction, high: Fraction) -> Fraction:
    """Return the fraction with the smallest denominator from `low` to `high`, by continued fractions."""
    whole = math.ceil(low)
    if whole <= high:
        return Fraction(whole)
    return whole - 1 + 1 / _simplest_between(1 / (high - whole + 1), 1 / (low - whole + 1))
