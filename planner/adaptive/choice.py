"""Choose the fewest strips that see a wanted share of a surface: partial set cover.

Lazy greedy (Minoux, 1978): each time the strip that adds most; what a strip adds can only become less, so old figures
are bounds and few need to be computed again. Greedy is within ln n of the best. An exchange then improves on it: strips
that are not needed are given up, two are replaced by one, and one by another that sees more, until nothing helps.
"""

import heapq
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from planner.arrays import BoolArray

_Table = npt.NDArray[np.float32]
# Rounds of exchange: each gives up a strip or sees more places, so this is never met in practice.
_MOST_ROUNDS = 1000


def choose(sees: BoolArray, seen: BoolArray, wanted: int, most: int) -> list[int]:
    """Return the numbers of few strips that together see at least `wanted` places, best first.

    Where that is not possible, or `most` strips are too few, the strips that see most.

    Args:
        sees: `(n, m)` which strip sees which place.
        seen: `(m,)` places that are seen already.
        wanted: How many places are to be seen in the end, those seen already included.
        most: How many strips may be chosen.
    """
    useful = np.flatnonzero(~seen & sees.any(axis=0))
    left = sees[:, useful]
    missing = min(wanted - int(seen.sum()), len(useful))
    chosen = lazy_greedy(left, missing, most)
    return by_gain(left, exchange(left, chosen, missing))


def lazy_greedy(sees: BoolArray, wanted: int, most: int) -> list[int]:
    """Return strips until `wanted` places are seen; each is the one that adds most to those before it."""
    covered = np.zeros(sees.shape[1], dtype=np.bool_)
    bounds = [(-int(gain), number) for number, gain in enumerate(sees.sum(axis=1))]
    heapq.heapify(bounds)
    chosen: list[int] = []
    while int(covered.sum()) < wanted and len(chosen) < most and bounds:
        number = bounds[0][1]
        gain = int(np.count_nonzero(sees[number] & ~covered))
        if gain == 0:
            heapq.heappop(bounds)
        elif -gain == bounds[0][0]:
            heapq.heappop(bounds)
            chosen.append(number)
            covered |= sees[number]
        else:
            heapq.heapreplace(bounds, (-gain, number))
    return chosen


def exchange(sees: BoolArray, chosen: Sequence[int], wanted: int) -> list[int]:
    """Return at most as many strips that see no less, or at least `wanted` places, after exchanges."""
    table = np.asarray(sees, dtype=np.float32)
    best = list(chosen)
    for _ in range(_MOST_ROUNDS if best else 0):
        better = _without_one(sees, best, wanted) or _one_for_two(table, best, wanted) or _one_for_one(table, best)
        if better is None:
            break
        best = better
    return best


def _without_one(sees: BoolArray, chosen: list[int], wanted: int) -> list[int] | None:
    """Return the strips without one that is not needed."""
    times = sees[chosen].sum(axis=0)
    covered = int(np.count_nonzero(times))
    for place, number in enumerate(chosen):
        if covered - int(np.count_nonzero(sees[number] & (times == 1))) >= wanted:
            return chosen[:place] + chosen[place + 1 :]
    return None


def _one_for_two(table: _Table, chosen: list[int], wanted: int) -> list[int] | None:
    """Return the strips with two of them replaced by one, where the wanted places are still seen."""
    times = table[chosen].sum(axis=0)
    for place in range(1, len(chosen)):
        without = times - table[chosen[place]] - table[chosen[:place]]
        missing = without < 0.5
        gains = table @ missing.T.astype(np.float32)
        reached = table.shape[1] - missing.sum(axis=1) + gains
        number, other = np.unravel_index(int(np.argmax(reached)), reached.shape)
        if reached[number, other] > wanted - 0.5:
            return [each for at, each in enumerate(chosen) if at not in (place, int(other))] + [int(number)]
    return None


def _one_for_one(table: _Table, chosen: list[int]) -> list[int] | None:
    """Return the strips with one of them replaced by another, where more places are seen then."""
    times = table[chosen].sum(axis=0)
    missing = times - table[chosen] < 0.5
    reached = table.shape[1] - missing.sum(axis=1) + table @ missing.T.astype(np.float32)
    number, place = np.unravel_index(int(np.argmax(reached)), reached.shape)
    if reached[number, place] > np.count_nonzero(times) + 0.5:
        return [*chosen[: int(place)], *chosen[int(place) + 1 :], int(number)]
    return None


def by_gain(sees: BoolArray, chosen: Sequence[int]) -> list[int]:
    """Return the strips in the order in which each adds most to those before it."""
    order = lazy_greedy(sees[np.asarray(chosen, dtype=np.int64)], sees.shape[1], len(chosen))
    return [chosen[number] for number in order]
