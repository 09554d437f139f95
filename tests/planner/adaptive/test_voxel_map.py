import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.adaptive.voxel_map import FREE, SURFACE, UNKNOWN, VoxelMap
from planner.arrays import FloatArray
from planner.cell.workpiece import Cylinder
from planner.geometry.signed_distance_field import look_up

BOUNDS = Cylinder(60.0, 40.0, (5.0, -3.0, 10.0))
RANDOM = np.random.default_rng(0)


def places(count: int = 3000, side_mm: float = 90.0) -> FloatArray:
    return np.asarray(RANDOM.uniform(-0.5, 0.5, (count, 3)) * side_mm + (5.0, -3.0, 30.0))


def distance_from_bounds_mm(points: FloatArray) -> FloatArray:
    """Return the signed distance from the bounding cylinder; below 0 inside."""
    x, y, z = (points - BOUNDS.middle_mm).T
    aside, above = np.hypot(x, y) - 30.0, np.abs(z - 20.0) - 20.0
    outside = np.hypot(np.maximum(aside, 0.0), np.maximum(above, 0.0))
    return np.asarray(outside + np.minimum(np.maximum(aside, above), 0.0))


def test_the_cylinder_is_unknown_and_all_else_is_free() -> None:
    voxels, points = VoxelMap(BOUNDS, 2.0), places()
    inside_mm = -distance_from_bounds_mm(points)
    states = voxels.states_at(points)
    assert (states[inside_mm > 0.0] == UNKNOWN).all()
    assert (states[inside_mm < -2.0 * np.sqrt(3.0)] == FREE).all()


def test_what_is_solid_is_never_farther_than_the_field_says() -> None:
    voxels = VoxelMap(BOUNDS, 2.0)
    values, levels = voxels.field()
    points = np.concatenate((places(), places(side_mm=800.0)))
    said_mm = np.array([look_up(values, levels, *point) for point in points])
    true_mm = distance_from_bounds_mm(points)
    outside = true_mm > 0.0
    assert (said_mm[outside] <= true_mm[outside]).all()
    assert (said_mm[true_mm < -4.0] < 0.0).all()
    near = outside & (true_mm < 30.0)
    assert (true_mm - said_mm)[near].max() < 6.0 * np.sqrt(3.0)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.floats(-70.0, 70.0), min_size=6, max_size=6), st.sampled_from([1.0, 2.5]))
def test_a_ray_frees_what_it_passes_and_nothing_else(ends: list[float], voxel_mm: float) -> None:
    voxels = VoxelMap(BOUNDS, voxel_mm)
    before = voxels.states.copy()
    origin, point = np.array(ends[:3]), np.array(ends[3:])
    length_mm = float(np.linalg.norm(point - origin))
    voxels.take(origin[np.newaxis], point[np.newaxis])
    along = np.linspace(0.0, 1.0, 4000)[:, np.newaxis]
    along = along[along[:, 0] * length_mm < length_mm - np.sqrt(3.0) * voxel_mm]
    passed, inside = voxels.cells(origin + along * (point - origin))
    expected = np.zeros(before.shape, dtype=bool)
    expected[tuple(passed[inside].T)] = True
    freed = (voxels.states == FREE) & (before == UNKNOWN)
    missed = expected & (before == UNKNOWN) & ~freed & (voxels.states != SURFACE)
    assert not missed.any()
    # Sampling a ray may step over the corner of a voxel; the walk does not.
    for cell in np.argwhere(freed & ~expected):
        corner = voxels.lower_mm + voxel_mm * cell
        steps = np.linspace(0.0, 1.0, 200_000)[:, np.newaxis]
        close = np.abs(origin + steps * (point - origin) - corner - 0.5 * voxel_mm).max(axis=1)
        assert close.min() < 0.5 * voxel_mm + 1e-3


def test_surface_stays_solid_whatever_passes_it_later() -> None:
    voxels = VoxelMap(BOUNDS, 2.0)
    middle = np.array([[5.0, -3.0, 30.0]])
    ahead, up = np.eye(3)[0], np.eye(3)[2]
    voxels.take(middle + 100.0 * ahead, middle)
    voxels.take(middle + 100.0 * up, middle - 15.0 * up)
    assert voxels.states_at(middle)[0] == SURFACE
    assert voxels.states_at(middle + 8.0 * up)[0] == FREE


def test_the_frontier_looks_from_the_unknown_to_the_free() -> None:
    voxels = VoxelMap(BOUNDS, 2.0)
    points, outward = voxels.frontier()
    assert (voxels.states_at(points) == UNKNOWN).all()
    assert (voxels.states_at(points + 4.0 * outward) == FREE).mean() > 0.99
    top = points[:, 2] > 47.0
    assert np.median(outward[top][:, 2]) == pytest.approx(1.0)
