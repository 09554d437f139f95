"""Unions of closed intervals on a circle.

An interval is (low, high) with low in 0 .. turn and high >= low; beyond the turn it continues at 0. The whole circle is
(0, turn). A union is stored as disjoint intervals in ascending order.
"""

import numpy as np

from planner.arrays import FloatArray
from planner.kernel import kernel


@kernel
def unite(lows: FloatArray, highs: FloatArray, count: int, turn: float) -> int:
    """Replace the first `count` intervals by their union, in place; return the number of intervals of the union."""
    if count == 0:
        return 0
    order = np.argsort(lows[:count])
    sorted_lows, sorted_highs = lows[:count][order], highs[:count][order]
    last = 0
    lows[0], highs[0] = sorted_lows[0], sorted_highs[0]
    for i in range(1, count):
        if sorted_lows[i] <= highs[last]:
            highs[last] = max(highs[last], sorted_highs[i])
        else:
            last += 1
            lows[last], highs[last] = sorted_lows[i], sorted_highs[i]
    first = 0
    while first < last and lows[first] + turn <= highs[last]:
        highs[last] = max(highs[last], highs[first] + turn)
        first += 1
    if highs[last] - lows[last] >= turn:
        lows[0], highs[0] = 0.0, turn
        return 1
    count = last - first + 1
    for i in range(count):
        lows[i], highs[i] = lows[first + i], highs[first + i]
    return count


@kernel
def contains(lows: FloatArray, highs: FloatArray, position: float, turn: float, tolerance: float) -> bool:
    """Return whether a position in 0 .. turn is in one of the intervals."""
    for i in range(len(lows)):
        if lows[i] - tolerance <= position <= highs[i] + tolerance or position + turn <= highs[i] + tolerance:
            return True
    return False
