import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from planner.geometry.bounding_volume_hierarchy import (
    BoundingVolumeHierarchy,
    bounding_volume_hierarchy,
    nearest_triangle,
    triangle_distance2,
)

Array = NDArray[np.float64]


def random_triangles(count: int, seed: int) -> Array:
    rng = np.random.default_rng(seed)
    sizes = rng.choice([0.1, 5.0, 60.0], (count, 1, 1))
    return rng.uniform(-100.0, 100.0, (count, 1, 3)) + sizes * rng.uniform(-1.0, 1.0, (count, 3, 3))


def nearest_of(hierarchy: BoundingVolumeHierarchy, p: Array, guess: int = 0) -> tuple[float, int]:
    return nearest_triangle(hierarchy.triangles, hierarchy.boxes, float(p[0]), float(p[1]), float(p[2]), guess)


@pytest.mark.parametrize("count", [1, 2, 3, 17, 1000])
def test_the_distance_is_the_one_that_trimesh_finds(count: int) -> None:
    triangles = random_triangles(count, count)
    hierarchy = bounding_volume_hierarchy(triangles)
    rng = np.random.default_rng(1)
    points = rng.uniform(-150.0, 150.0, (100, 3))
    mesh = trimesh.Trimesh(**trimesh.triangles.to_kwargs(triangles))  # type: ignore[no-untyped-call]  # no types shipped
    exact = trimesh.proximity.closest_point(mesh, points)[1]  # type: ignore[no-untyped-call]  # no types shipped
    for point, distance in zip(points, exact, strict=True):
        found, triangle = nearest_of(hierarchy, point, int(rng.integers(len(hierarchy.triangles))))
        assert found**0.5 == pytest.approx(distance, abs=1e-9)
        x, y, z = map(float, point)
        assert triangle_distance2(hierarchy.triangles, triangle, x, y, z) == found


coordinate = st.integers(-8, 8).map(float)
corner = st.tuples(coordinate, coordinate, coordinate)


@settings(deadline=None, max_examples=200)
@given(corners=st.tuples(corner, corner, corner), point=corner)
def test_a_triangle_is_as_far_as_its_nearest_point_even_where_it_is_a_line_or_a_point(
    corners: tuple[tuple[float, ...], ...], point: tuple[float, float, float]
) -> None:
    triangle = np.array(corners)
    u, v = np.meshgrid(np.linspace(0.0, 1.0, 41), np.linspace(0.0, 1.0, 41))
    shares = np.stack([(1.0 - u) * (1.0 - v), u * (1.0 - v), v], axis=-1).reshape(-1, 3)
    sampled = np.linalg.norm(shares @ triangle - point, axis=1).min()
    distance = triangle_distance2(triangle[np.newaxis], 0, *point) ** 0.5
    assert sampled - 28.0 / 40 <= distance <= sampled + 1e-9


def test_every_triangle_is_in_the_tree_and_every_box_holds_what_is_below_it() -> None:
    triangles = random_triangles(100, 0)
    ours, boxes, members = bounding_volume_hierarchy(triangles)
    assert np.array_equal(ours, triangles[members])
    assert {t.tobytes() for t in ours} == {t.tobytes() for t in triangles}
    n_leaves = len(boxes) // 2
    leaves = ours.reshape(n_leaves, -1, 3)
    for node in range(1, 2 * n_leaves):
        span = n_leaves >> (node.bit_length() - 1)
        first = node * span - n_leaves
        assert boxes[node, :3] == pytest.approx(leaves[first : first + span].min(axis=(0, 1)))
        assert boxes[node, 3:] == pytest.approx(leaves[first : first + span].max(axis=(0, 1)))
