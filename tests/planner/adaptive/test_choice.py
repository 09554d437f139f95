import numpy as np
import pytest

from planner.adaptive.choice import choose, exchange, lazy_greedy
from planner.arrays import BoolArray
from tools.bench.set_cover import fewest_strips


def patches(seed: int, strips: int, places: int, radius: float) -> BoolArray:
    """Strips that see the places within an ellipse about them, on the unit square."""
    rng = np.random.default_rng(seed)
    away = rng.random((strips, 1, 2)) - rng.random((1, places, 2))
    turn = rng.random((strips, 1)) * np.pi
    along = np.cos(turn) * away[..., 0] + np.sin(turn) * away[..., 1]
    across = np.cos(turn) * away[..., 1] - np.sin(turn) * away[..., 0]
    return np.asarray((along / radius) ** 2 + (across / (0.5 * radius)) ** 2 < 1.0)


FAMILY = [(seed, strips, radius) for seed, (strips, radius) in enumerate([(30, 0.45), (40, 0.4), (50, 0.4)] * 4)]


def test_hardly_more_strips_are_chosen_than_the_fewest() -> None:
    chosen, best, greedy = [], [], []
    for seed, strips, radius in FAMILY:
        sees = patches(seed, strips, 60, radius)
        wanted = int(0.97 * sees.any(axis=0).sum())
        numbers = choose(sees, np.zeros(60, dtype=np.bool_), wanted, strips)
        assert sees[numbers].any(axis=0).sum() >= wanted
        chosen.append(len(numbers))
        best.append(fewest_strips(sees, wanted).at_least)
        greedy.append(len(lazy_greedy(sees, wanted, strips)))
    assert all(ours <= max(1.15 * least, least + 1) for ours, least in zip(chosen, best, strict=True))
    assert sum(chosen) <= 1.06 * sum(best)
    assert sum(chosen) < sum(greedy)


def plain_greedy(sees: BoolArray, wanted: int, most: int) -> list[int]:
    covered, chosen = np.zeros(sees.shape[1], dtype=np.bool_), list[int]()
    while covered.sum() < wanted and len(chosen) < most:
        gains = (sees & ~covered).sum(axis=1)
        if not gains.any():
            break
        chosen.append(int(np.argmax(gains)))
        covered |= sees[chosen[-1]]
    return chosen


@pytest.mark.parametrize("seed", range(20))
def test_lazy_greedy_chooses_as_greedy_does(seed: int) -> None:
    sees = patches(seed, 80, 200, 0.3)
    for wanted, most in ((200, 80), (120, 80), (200, 3), (0, 80)):
        assert lazy_greedy(sees, wanted, most) == plain_greedy(sees, wanted, most)


@pytest.mark.parametrize("seed", range(20))
def test_an_exchange_never_takes_more_strips_and_sees_no_less_than_wanted(seed: int) -> None:
    sees = patches(seed, 80, 200, 0.3)
    wanted = int(0.9 * sees.any(axis=0).sum())
    before = lazy_greedy(sees, wanted, 80)
    after = exchange(sees, before, wanted)
    assert len(after) <= len(before)
    assert len(set(after)) == len(after)
    assert sees[after].any(axis=0).sum() >= wanted


def test_what_greedy_is_known_to_choose_badly_is_put_right() -> None:
    # Greedy takes the middle first and then needs both sides; the sides alone see everything.
    sees = np.zeros((3, 10), dtype=np.bool_)
    sees[0, 2:8], sees[1, :5], sees[2, 5:] = True, True, True
    assert len(lazy_greedy(sees, 10, 3)) == 3
    assert sorted(choose(sees, np.zeros(10, dtype=np.bool_), 10, 3)) == [1, 2]


def test_what_was_seen_already_counts_and_needs_no_strip() -> None:
    sees = np.eye(4, dtype=np.bool_)
    seen = np.array([True, True, False, False])
    assert choose(sees, seen, 2, 4) == []
    assert len(choose(sees, seen, 3, 4)) == 1
    assert sorted(choose(sees, seen, 4, 4)) == [2, 3]


def test_where_the_wanted_share_cannot_be_had_all_that_can_be_seen_is() -> None:
    sees = np.array([[True, False, False], [False, True, False]])
    nothing = np.zeros(3, dtype=np.bool_)
    assert sorted(choose(sees, nothing, 3, 5)) == [0, 1]
    assert len(choose(sees, nothing, 3, 1)) == 1
    assert choose(sees[:0], nothing, 3, 5) == []


def test_the_strip_that_adds_most_comes_first() -> None:
    sees = np.zeros((2, 9), dtype=np.bool_)
    sees[0, :3], sees[1, 3:] = True, True
    assert choose(sees, np.zeros(9, dtype=np.bool_), 9, 2) == [1, 0]
