"""The order of strips with the shortest time: an open tour in which each strip may be swept from either end.

From the end of one strip to the beginning of the next, the slower of table and arm decides. The tour begins at a
strip near the start and goes on to the nearest; then parts of it are reversed (2-opt) or moved (Or-opt) while
that saves time. A part that is reversed has its strips swept the other way.
"""

from collections.abc import Iterator
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from planner.arrays import FloatArray, IndexArray

# Less than this is not worth another round, in s.
_SAVES_S = 1e-9
_LONGEST_MOVED = 3
# Beginnings that are tried, times sweeps.
_WORK = 200


class Visit(NamedTuple):
    """A strip in a tour: its number, and whether it is swept from its end to its beginning."""

    strip: int
    is_reversed: bool


class TravelTimes(NamedTuple):
    """How long it takes from one strip to another, in s.

    A sweep is a strip in one direction: sweep 2 k is strip k from its beginning to its end, 2 k + 1 the way back.

    Attributes:
        between_s: `(2 n, 2 n)`, from where a sweep ends to where another one begins.
        from_start_s: `(2 n,)`, from where arm and table are before the first strip to where a sweep begins.
    """

    between_s: FloatArray
    from_start_s: FloatArray

    def tours_s(self, tours: IndexArray) -> FloatArray:
        """Return how long the ways of tours `(m, n)` of sweeps take together, without the strips themselves."""
        if not tours.shape[1]:
            return np.zeros(len(tours))
        return np.asarray(self.from_start_s[tours[:, 0]] + self.between_s[tours[:, :-1], tours[:, 1:]].sum(axis=1))


def travel_times(ends_s: FloatArray, from_start_s: FloatArray) -> TravelTimes:
    """Return the times of sweeps from those between the ends of strips.

    Args:
        ends_s: `(2 n, 2 n)`; end 2 k is the beginning of strip k, 2 k + 1 its end.
        from_start_s: `(2 n,)`, from the start to each end.
    """
    begins = np.arange(len(ends_s))
    return TravelTimes(ends_s[begins ^ 1][:, begins], from_start_s)


def best_tour(times: TravelTimes) -> list[Visit]:
    """Return a tour of all strips that no reversal of a part and no move of a short part makes shorter.

    Of several such tours, which begin with different strips, the shortest.
    """
    count = len(times.from_start_s)
    begins = np.argsort(times.from_start_s, kind="stable")[: max(1, _WORK // max(1, count))]
    tours = [_improved(times, _nearest_first(times, int(begin))) for begin in begins]
    if not tours:
        return []
    tour = tours[int(np.argmin(times.tours_s(np.array(tours))))]
    return [Visit(sweep // 2, sweep % 2 == 1) for sweep in tour]


def _improved(times: TravelTimes, tour: list[int]) -> list[int]:
    """Return a tour of sweeps that no change makes shorter."""
    least_s = float(times.tours_s(np.array([tour]))[0])
    while changed := list(_changed(tour)):
        tours_s = times.tours_s(np.array(changed))
        best = int(np.argmin(tours_s))
        if tours_s[best] > least_s - _SAVES_S:
            break
        tour, least_s = changed[best], float(tours_s[best])
    return tour


def tour_s(times: TravelTimes, tour: list[Visit]) -> float:
    """Return how long the ways of a tour take together, without the strips themselves."""
    sweeps = [2 * visit.strip + visit.is_reversed for visit in tour]
    ways_s = [float(times.between_s[before, after]) for before, after in pairwise(sweeps)]
    return sum(ways_s, float(times.from_start_s[sweeps[0]]) if sweeps else 0.0)


def _nearest_first(times: TravelTimes, begin: int) -> list[int]:
    """Return the tour of sweeps that begins with one and goes on to the nearest each time."""
    left = np.ones(len(times.from_start_s), dtype=np.bool_)
    tour = [begin]
    left[[begin, begin ^ 1]] = False
    while left.any():
        nearest = int(np.argmin(np.where(left, times.between_s[tour[-1]], np.inf)))
        tour.append(nearest)
        left[[nearest, nearest ^ 1]] = False
    return tour


def _changed(tour: list[int]) -> Iterator[list[int]]:
    """Yield the tour with a part reversed, or a short part elsewhere, either way round."""
    n = len(tour)
    for first in range(n):
        for end in range(first + 1, n + 1):
            part = tour[first:end]
            back = [sweep ^ 1 for sweep in reversed(part)]
            yield tour[:first] + back + tour[end:]
            if end - first > _LONGEST_MOVED:
                continue
            rest = tour[:first] + tour[end:]
            for at in range(len(rest) + 1):
                if at != first:
                    yield rest[:at] + part + rest[at:]
                    yield rest[:at] + back + rest[at:]
