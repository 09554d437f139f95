from itertools import pairwise

import numpy as np
import pytest

from tools.envelope import envelope


@pytest.mark.parametrize("seed", range(5))
def test_a_thinned_curve_covers_what_the_curve_covers(seed: int) -> None:
    """In each column of the drawing the same lowest and highest sample, and the same ends."""
    chance = np.random.default_rng(seed)
    time_s = np.cumsum(chance.exponential(size=20_000))
    values = np.cumsum(chance.normal(size=20_000))

    times, thinned = envelope(time_s, values, columns=100)

    assert len(times) <= 400
    assert np.all(np.diff(times) > 0.0)
    edges = np.linspace(time_s[0], time_s[-1], 101)
    for begin, end in pairwise(edges):
        inside, kept = (
            values_[(times_ >= begin) & (times_ <= end)] for times_, values_ in ((time_s, values), (times, thinned))
        )
        if len(inside):
            assert (inside.min(), inside.max(), inside[0], inside[-1]) == (kept.min(), kept.max(), kept[0], kept[-1])


def test_a_short_curve_is_left_alone() -> None:
    time_s, values = np.arange(10.0), np.arange(10.0) ** 2

    times, same = envelope(time_s, values, columns=100)

    assert times is time_s
    assert same is values
