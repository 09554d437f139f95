"""Unions of closed intervals on a circle.

An interval is (low, high) with low in 0 .. turn and high >= low; beyond the turn it continues at 0. The whole circle is
(0, turn). A union is stored as disjoint intervals in ascending order.
"""

from planner.arrays import FloatArray
from planner.kernel import kernel


@kernel
def unite(lows: FloatArray, highs: FloatArray, count: int, turn: float) -> int:
    """Replace the first `count` intervals by their union, in place; return the number of intervals of the union."""
    if count == 0:
        return 0
    _sort(lows, highs, count)
    last = 0
    for i in range(1, count):
        if lows[i] <= highs[last]:
            highs[last] = max(highs[last], highs[i])
        else:
            last += 1
            lows[last], highs[last] = lows[i], highs[i]
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
def _sort(lows: FloatArray, highs: FloatArray, count: int) -> None:
    """Sort intervals by their lower ends, in place, by Shell's method: numba takes 2 s to compile numpy's."""
    gap = count // 2
    while gap > 0:
        for i in range(gap, count):
            low, high, place = lows[i], highs[i], i
            while place >= gap and lows[place - gap] > low:
                lows[place], highs[place] = lows[place - gap], highs[place - gap]
                place -= gap
            lows[place], highs[place] = low, high
        gap //= 2


@kernel
def contains(lows: FloatArray, highs: FloatArray, position: float, turn: float, tolerance: float) -> bool:
    """Return whether a position in 0 .. turn is in one of the intervals."""
    for i in range(len(lows)):
        if lows[i] - tolerance <= position <= highs[i] + tolerance or position + turn <= highs[i] + tolerance:
            return True
    return False
