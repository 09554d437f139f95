from itertools import permutations, product

import numpy as np
import pytest

from planner.adaptive.order import TravelTimes, best_tour, tour_s, travel_times


def random_times(seed: int, strips: int) -> TravelTimes:
    """Strips as segments in the plane, and the way between two points as its longer side: table against arm."""
    rng = np.random.default_rng(seed)
    ends = rng.random((2 * strips + 1, 2))
    ways_s = np.abs(ends[:, np.newaxis] - ends).max(axis=2)
    return travel_times(ways_s[:-1, :-1], ways_s[-1, :-1])


def shortest_s(times: TravelTimes, strips: int) -> float:
    tours = [
        [2 * strip + way for strip, way in zip(order, ways, strict=True)]
        for order in permutations(range(strips))
        for ways in product((0, 1), repeat=strips)
    ]
    return float(times.tours_s(np.array(tours)).min())


def test_a_tour_is_nearly_the_shortest_of_all() -> None:
    found = [
        (tour_s(times, best_tour(times)), shortest_s(times, 5)) for times in (random_times(s, 5) for s in range(20))
    ]
    assert all(ours >= best - 1e-12 for ours, best in found)
    assert sum(ours for ours, _ in found) <= 1.03 * sum(best for _, best in found)
    assert max(ours / best for ours, best in found) <= 1.25


@pytest.mark.parametrize("strips", [0, 1, 2, 30])
def test_each_strip_is_visited_once(strips: int) -> None:
    tour = best_tour(random_times(1, strips))
    assert sorted(visit.strip for visit in tour) == list(range(strips))


def test_a_strip_is_swept_from_the_end_that_is_nearer() -> None:
    # On a line: the start at 0, a strip from 3 to 1, one from 4 to 6.
    ends = np.array([3.0, 1.0, 4.0, 6.0])
    times = travel_times(np.abs(ends[:, np.newaxis] - ends), np.abs(ends))
    tour = best_tour(times)
    assert [tuple(visit) for visit in tour] == [(0, True), (1, False)]
    assert tour_s(times, tour) == pytest.approx(1.0 + 1.0)


def test_a_tour_gets_better_than_always_going_on_to_the_nearest() -> None:
    # Nearest first goes 0, 1, -2, 7; it is shorter to begin with -2.
    ends = np.repeat([1.0, -2.0, 7.0], 2)
    times = travel_times(np.abs(ends[:, np.newaxis] - ends), np.abs(ends))
    assert tour_s(times, best_tour(times)) == pytest.approx(2.0 + 9.0)
