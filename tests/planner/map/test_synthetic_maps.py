import numpy as np
import pytest

from planner.map.synthetic_maps import MapFamily, blocks_map, synthetic_map


@pytest.mark.parametrize("forbidden", [0.0, 0.2, 0.5])
def test_the_share_that_is_forbidden_is_the_familys(forbidden: float) -> None:
    configuration_map = synthetic_map(MapFamily(forbidden), 1)
    assert (~configuration_map.allowed).mean() == pytest.approx(forbidden, abs=0.02)


def test_the_same_seed_gives_the_same_map_and_another_another() -> None:
    family = MapFamily(location_count=10)
    assert np.array_equal(synthetic_map(family, 1).values, synthetic_map(family, 1).values)
    assert not np.array_equal(synthetic_map(family, 1).values, synthetic_map(family, 2).values)


def test_larger_obstacles_are_fewer() -> None:
    def borders(size: float) -> int:
        allowed = synthetic_map(MapFamily(0.3, size), 1).allowed
        return int((allowed != np.roll(allowed, 1, axis=1)).sum())

    assert borders(2.0) > 2 * borders(8.0)


def test_a_slope_lets_the_pattern_drift() -> None:
    still, drifting = synthetic_map(MapFamily(), 4), synthetic_map(MapFamily(slope=1.0), 4)
    assert np.array_equal(np.roll(still.values[30], 30), drifting.values[30])


def test_blocks_are_black_with_a_gray_border() -> None:
    values = blocks_map(20, 40, [(5, 8, 10, 14)], edge=2).values
    assert not values[5:9, 10:15].any()
    assert 0.0 < values[6, 15] < values[6, 16] < values[6, 17] == 1.0
