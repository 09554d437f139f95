import numpy as np
import pytest
import trimesh

from planner.adaptive.unseen_regions import connected, unseen_regions
from planner.geometry.ray_casting import RayCaster
from planner.scanning.coverage import SAMPLES, Coverage
from planner.scanning.probe import LaserProbe, Sight


def box_coverage() -> tuple[trimesh.Trimesh, Coverage]:
    mesh: trimesh.Trimesh = trimesh.creation.box((100.0, 100.0, 10.0))
    coverage = Coverage(mesh, RayCaster(mesh), LaserProbe(), 2.0)
    coverage.codes[:] = Sight.SEEN
    return mesh, coverage


def test_two_patches_are_two_regions_with_their_areas_and_reasons() -> None:
    mesh, coverage = box_coverage()
    x, y, z = coverage.points.T
    top = z > 4.99
    large, small = top & (x > 10.0), top & (x < -30.0) & (y > 20.0)
    coverage.codes[large], coverage.codes[small] = Sight.INCIDENCE, Sight.OCCLUDED
    coverage.codes[large & (y > 40.0)] = Sight.NEVER_IN_VIEW
    regions = unseen_regions(coverage, large & (y > 0.0), float(mesh.area))
    assert [region.reason for region in regions] == [Sight.INCIDENCE, Sight.OCCLUDED]
    assert regions[0].area_mm2 == pytest.approx(40.0 * 100.0, rel=0.1)
    assert regions[1].area_mm2 == pytest.approx(20.0 * 30.0, rel=0.25)
    assert regions[0].can_be_seen_mm2 == pytest.approx(0.5 * regions[0].area_mm2, rel=0.1)
    np.testing.assert_allclose(regions[0].center_W, (30.0, 0.0, 5.0), atol=3.0)
    np.testing.assert_allclose(regions[0].normal_W, (0.0, 0.0, 1.0), atol=1e-9)


def test_the_two_sides_of_a_thin_wall_are_two_regions() -> None:
    grid = np.stack(np.meshgrid(np.arange(10.0), np.arange(10.0), [0.0]), axis=-1).reshape(-1, 3)
    points = np.concatenate((grid, grid + np.array([0.0, 0.0, 0.5])))
    normals = np.repeat([(0.0, 0.0, -1.0), (0.0, 0.0, 1.0)], len(grid), axis=0)
    numbers = connected(points, normals, 1.5)
    assert len(set(numbers[:100].tolist())) == len(set(numbers[100:].tolist())) == 1
    assert numbers[0] != numbers[100]


def test_where_all_was_seen_there_is_no_region() -> None:
    mesh, coverage = box_coverage()
    assert unseen_regions(coverage, np.zeros(SAMPLES, dtype=np.bool_), float(mesh.area)) == []


def test_the_regions_together_are_what_was_not_seen() -> None:
    mesh, coverage = box_coverage()
    coverage.codes[::7] = Sight.OCCLUDED
    regions = unseen_regions(coverage, np.zeros(SAMPLES, dtype=np.bool_), float(mesh.area))
    share = float(np.mean(coverage.codes != Sight.SEEN))
    assert sum(region.area_mm2 for region in regions) == pytest.approx(share * mesh.area)
