from typing import Any

import numpy as np
import pytest
import trimesh
from trimesh.ray.ray_triangle import RayMeshIntersector

from planner.arrays import FloatArray
from planner.geometry.ray_casting import RayCaster


def aimed_rays(count: int, radius_mm: float) -> tuple[FloatArray, FloatArray]:
    """Return rays from all directions around a ball of that radius into its neighborhood; some of them miss it."""
    rng = np.random.default_rng(3)
    origins = rng.normal(size=(count, 3))
    origins *= 4.0 * radius_mm / np.linalg.norm(origins, axis=1, keepdims=True)
    ways = rng.uniform(-1.2 * radius_mm, 1.2 * radius_mm, size=(count, 3)) - origins
    return origins, ways / np.linalg.norm(ways, axis=1, keepdims=True)


def test_hits_are_those_of_an_exact_caster_in_double_precision() -> None:
    mesh = trimesh.creation.icosphere(subdivisions=3, radius=80.0)
    mesh.apply_translation((300.0, -200.0, 100.0))
    origins, directions = aimed_rays(400, 80.0)
    origins += np.array((300.0, -200.0, 100.0))
    triangles, distances_mm = RayCaster(mesh).first_hits(origins, directions)
    exact: Any = RayMeshIntersector(mesh)  # type: ignore[no-untyped-call] # trimesh has no types here
    places, rays, expected = exact.intersects_location(origins, directions, multiple_hits=False)
    assert sorted(rays) == list(np.flatnonzero(triangles >= 0))
    assert 0 < len(rays) < 400
    assert (triangles[rays] == expected).all()
    hit = origins[rays] + distances_mm[rays, np.newaxis] * directions[rays]
    assert np.abs(hit - places).max() < 1e-9


def test_a_ray_that_meets_nothing_has_no_distance() -> None:
    triangles, distances_mm = RayCaster(trimesh.creation.box((10.0, 10.0, 10.0))).first_hits(
        np.array([[0.0, 0.0, 50.0]]), np.array([[0.0, 0.0, 1.0]])
    )
    assert triangles.tolist() == [-1]
    assert np.isnan(distances_mm).all()


def test_triangles_without_area_are_passed_over() -> None:
    box = trimesh.creation.box((10.0, 10.0, 10.0))
    flat = [[0, 0, 1], [2, 2, 2]]
    mesh = trimesh.Trimesh(box.vertices, np.concatenate((flat, box.faces)), process=False)
    grid = np.linspace(-5.0, 5.0, 21)
    origins = np.array([(x, y, 50.0) for x in grid for y in grid])
    triangles, distances_mm = RayCaster(mesh).first_hits(origins, np.tile((0.0, 0.0, -1.0), (len(origins), 1)))
    inside = np.abs(origins[:, :2]).max(axis=1) < 5.0
    assert distances_mm[inside] == pytest.approx(45.0)
    assert (triangles[inside] >= 2).all()


@pytest.mark.parametrize(
    ("eye", "is_seen"),
    [
        ((0.0, 0.0, 60.0), True),
        ((60.0, 0.0, 60.0), True),
        ((60.0, 0.0, 4.0), False),  # below the plane of the top
        ((0.0, 0.0, -60.0), False),
        ((0.0, 60.0, 30.0), False),  # behind the other box
        ((0.0, 60.0, 130.0), True),  # over it
        ((0.0, 14.0, 12.0), True),  # before it: objects behind the eye do not matter
    ],
)
def test_an_eye_sees_a_point_that_faces_it_with_nothing_between(eye: tuple[float, float, float], is_seen: bool) -> None:
    other = trimesh.creation.box((10.0, 10.0, 40.0)).apply_translation((0.0, 20.0, 15.0))
    both: trimesh.Trimesh = trimesh.creation.box((10.0, 10.0, 10.0)) + other
    caster = RayCaster(both)
    top, up = np.array([[0.0, 0.0, 5.0]]), np.array([[0.0, 0.0, 1.0]])
    assert caster.can_see(top, up, np.array([eye])).tolist() == [is_seen]
