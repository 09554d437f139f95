"""Unions of intervals compared with points of a circle."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from planner.search.interval_union import contains, unite

TURN = 12.0
POINTS = np.arange(0.0, TURN, 0.25)

intervals = st.lists(st.tuples(st.integers(0, 47), st.integers(0, 48)), max_size=12)


def covered(low: float, high: float) -> set[float]:
    return {float(p) for p in POINTS if any(low <= p + turned <= high for turned in (0.0, TURN))}


@given(intervals)
def test_a_union_covers_what_its_intervals_cover_and_is_disjoint(drawn: list[tuple[int, int]]) -> None:
    lows = np.array([low / 4.0 for low, _ in drawn] + [0.0])
    highs = np.array([(low + length) / 4.0 for low, length in drawn] + [0.0])
    expected = set().union(*(covered(low, high) for low, high in zip(lows[:-1], highs[:-1], strict=True)))
    count = unite(lows, highs, len(drawn), TURN)
    pieces = [covered(low, high) for low, high in zip(lows[:count], highs[:count], strict=True)]
    assert set().union(*pieces) == expected
    assert sum(len(piece) for piece in pieces) == len(expected)
    assert np.all(np.diff(lows[:count]) > 0.0)
    for p in POINTS:
        assert contains(lows[:count], highs[:count], float(p), TURN, 0.0) == (float(p) in expected)


def test_what_goes_all_around_becomes_the_whole_circle() -> None:
    lows, highs = np.array([9.0, 0.0, 5.0]), np.array([13.0, 5.0, 9.0])
    assert unite(lows, highs, 3, TURN) == 1
    assert (lows[0], highs[0]) == (0.0, TURN)


def test_single_points_are_kept() -> None:
    lows, highs = np.array([3.0, 1.0, 3.0]), np.array([3.0, 1.0, 3.0])
    assert unite(lows, highs, 3, TURN) == 2
    assert contains(lows[:2], highs[:2], 3.0, TURN, 0.0)
    assert not contains(lows[:2], highs[:2], 2.0, TURN, 0.5)
