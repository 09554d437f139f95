import numpy as np
import pytest

from planner.geometry.thinned_cloud import ThinnedCloud

RANDOM = np.random.default_rng(0)
POINTS = RANDOM.uniform(-30.0, 30.0, (5000, 3))
BEAMS = np.tile((0.0, 0.0, -1.0), (5000, 1))


def thinned(block: int, cell_mm: float = 5.0) -> ThinnedCloud:
    cloud = ThinnedCloud(cell_mm)
    for first in range(0, len(POINTS), block):
        cloud.take(POINTS[first : first + block], BEAMS[first : first + block])
    return cloud


def test_each_cell_has_the_mean_of_its_points() -> None:
    cloud = thinned(5000)
    cells = np.floor(POINTS / 5.0)
    one = (cells == cells[17]).all(axis=1)
    mean = POINTS[one].mean(axis=0)
    nearest = np.linalg.norm(cloud.points - mean, axis=1).argmin()
    assert cloud.points[nearest] == pytest.approx(mean)
    assert cloud.counts[nearest] == one.sum()
    assert cloud.counts.sum() == 5000
    assert len(cloud.points) == len(np.unique(cells, axis=0))


@pytest.mark.parametrize("block", [1, 7, 999])
def test_the_blocks_make_no_difference(block: int) -> None:
    points, beams = POINTS[:300], BEAMS[:300]
    whole, parts = ThinnedCloud(5.0), ThinnedCloud(5.0)
    whole.take(points, beams)
    for first in range(0, 300, block):
        parts.take(points[first : first + block], beams[first : first + block])
    np.testing.assert_allclose(parts.points, whole.points, atol=1e-12)
    assert (parts.counts == whole.counts).all()


def test_a_second_look_adds_no_points() -> None:
    cloud = thinned(5000)
    count = len(cloud.points)
    cloud.take(POINTS, BEAMS)
    assert len(cloud.points) == count
    assert np.linalg.norm(cloud.beams, axis=1) == pytest.approx(1.0)
