import numpy as np

from planner.adaptive.seen_surface import Estimate, apart
from planner.arrays import FloatArray
from planner.geometry.thinned_cloud import ThinnedCloud

RANDOM = np.random.default_rng(0)
NOISE_MM = 0.025


def estimate(points: FloatArray, beams: FloatArray) -> Estimate:
    cloud = ThinnedCloud(2.0)
    cloud.take(points + NOISE_MM * RANDOM.standard_normal(points.shape), beams)
    return Estimate(cloud)


def plate(count: int = 20_000) -> FloatArray:
    """Return points of a plate of 60 x 40 mm with a hole of 8 mm radius."""
    flat = RANDOM.uniform(-0.5, 0.5, (count, 2)) * (60.0, 40.0)
    return np.column_stack((flat[np.hypot(*flat.T) > 8.0], np.zeros((np.hypot(*flat.T) > 8.0).sum())))


def test_the_rim_of_a_plate_is_its_edge_and_the_edge_of_its_hole_and_looks_outward() -> None:
    points = plate()
    seen = estimate(points, np.tile((0.0, 0.0, -1.0), (len(points), 1)))
    rim = seen.rim
    radius = np.hypot(rim.points[:, 0], rim.points[:, 1])
    edge_mm = np.minimum(30.0 - np.abs(rim.points[:, 0]), 20.0 - np.abs(rim.points[:, 1]))
    at_edge, at_hole = edge_mm < 2.5, np.abs(radius - 8.0) < 2.5
    assert (at_edge | at_hole).all()
    assert at_edge.sum() > 60
    assert at_hole.sum() > 12
    inward = -rim.points[at_hole] / radius[at_hole, np.newaxis]
    assert np.einsum("ij,ij->i", rim.outward[at_hole], inward).min() > 0.5
    assert np.abs(rim.outward[:, 2]).max() < 0.1
    ahead = rim.points[at_edge] + 5.0 * rim.outward[at_edge]
    assert ((np.abs(ahead[:, 0]) > 30.0) | (np.abs(ahead[:, 1]) > 20.0)).all()


def test_a_whole_sphere_has_no_rim_and_a_cap_has_one() -> None:
    directions = RANDOM.standard_normal((40_000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    whole = estimate(25.0 * directions, -directions)
    assert len(whole.rim.points) < 0.005 * len(whole.points)
    cap = directions[directions[:, 2] > 0.2]
    rim = estimate(25.0 * cap, -cap).rim
    low = rim.points[:, 2] < 5.0 + 3.0
    assert low.mean() > 0.97
    assert (rim.outward[low][:, 2] < 0.0).mean() > 0.97


def test_the_surface_casts_shadows_where_it_was_seen_and_only_there() -> None:
    points = plate()
    seen = estimate(points, np.tile((0.0, 0.0, -1.0), (len(points), 1)))
    below = np.column_stack((RANDOM.uniform(-0.5, 0.5, (2000, 2)) * (90.0, 70.0), np.full(2000, -10.0)))
    radius = np.hypot(below[:, 0], below[:, 1])
    is_over = (np.abs(below[:, 0]) < 28.0) & (np.abs(below[:, 1]) < 18.0) & (radius > 10.0)
    is_beside = (np.abs(below[:, 0]) > 33.0) | (np.abs(below[:, 1]) > 23.0) | (radius < 5.0)
    up = np.tile((0.0, 0.0, 1.0), (len(below), 1))
    free = seen.caster.can_see(below, up, below + 100.0 * up)
    assert not free[is_over].any()
    assert free[is_beside].all()


def test_points_apart_have_no_other_within_the_distance() -> None:
    others = np.zeros((1, 3))
    assert apart(np.array([[1.0, 0.0, 0.0], [3.0, 0.0, 0.0]]), others, 2.0).tolist() == [1]
    assert apart(np.array([[1.0, 0.0, 0.0]]), np.empty((0, 3)), 2.0).tolist() == [0]
