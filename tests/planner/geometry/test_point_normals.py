import numpy as np

from planner.arrays import FloatArray
from planner.geometry.point_normals import point_normals
from planner.geometry.thinned_cloud import ThinnedCloud

NOISE_MM = 0.025


def sphere(count: int = 40_000, radius_mm: float = 20.0) -> FloatArray:
    directions = np.random.default_rng(1).standard_normal((count, 3))
    return np.asarray(radius_mm * directions / np.linalg.norm(directions, axis=1, keepdims=True))


def test_the_normals_of_a_noisy_sphere_point_away_from_its_middle() -> None:
    points = sphere()
    cloud = ThinnedCloud(1.0)
    cloud.take(points * (1.0 + NOISE_MM / 20.0 * np.random.default_rng(2).standard_normal((len(points), 1))), -points)
    found = point_normals(cloud.points, cloud.beams, 3.0)
    outward = cloud.points / np.linalg.norm(cloud.points, axis=1, keepdims=True)
    cosines = np.einsum("ij,ij->i", found.normals, outward)
    assert found.is_known.all()
    assert np.degrees(np.arccos(cosines.min())) < 3.0


def test_the_two_sides_of_a_thin_plate_are_kept_apart() -> None:
    flat = np.random.default_rng(3).uniform(0.0, 20.0, (4000, 2))
    top = np.column_stack((flat, np.full(4000, 0.6)))
    bottom = np.column_stack((flat, np.zeros(4000)))
    beams = np.repeat([(0.0, 0.0, -1.0), (0.0, 0.0, 1.0)], 4000, axis=0)
    found = point_normals(np.concatenate((top, bottom)), beams, 1.5)
    assert np.abs(found.normals + beams).max() < 1e-9
    assert found.roughness_mm.max() < 1e-6


def test_a_line_of_points_has_no_normal() -> None:
    line = np.column_stack((np.arange(50.0) / 10.0, np.zeros(50), np.zeros(50)))
    beams = np.tile((0.0, 0.0, -1.0), (50, 1))
    found = point_normals(line, beams, 2.0)
    assert not found.is_known.any()
    assert (found.normals == -beams).all()


def test_no_points_are_no_fault() -> None:
    assert len(point_normals(np.empty((0, 3)), np.empty((0, 3)), 1.0).normals) == 0
