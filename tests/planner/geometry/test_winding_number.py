import math

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from planner.geometry.winding_number import BESIDE, winding_numbers

Array = NDArray[np.float64]


def solid_angle_windings(triangles: Array, points: Array) -> Array:
    """The sum of the triangles' solid angles over a whole sphere's (van Oosterom and Strackee, 1983)."""
    a, b, c = np.moveaxis(triangles[np.newaxis] - points[:, np.newaxis, np.newaxis], 2, 0)
    la, lb, lc = (np.linalg.norm(side, axis=2) for side in (a, b, c))
    volume = np.sum(a * np.cross(b, c), axis=2)
    ab, bc, ca = (np.sum(p * q, axis=2) for p, q in ((a, b), (b, c), (c, a)))
    angles = 2.0 * np.arctan2(volume, la * lb * lc + ab * lc + bc * la + ca * lb)
    return np.asarray(angles.sum(axis=1) / (4.0 * math.pi))


@pytest.mark.parametrize("seed", range(8))
def test_the_number_is_that_of_the_solid_angles(seed: int) -> None:
    turn = Rotation.random(random_state=seed).as_matrix()
    tube = trimesh.creation.annulus(r_min=6.0, r_max=9.0, height=10.0, sections=11)
    ball = trimesh.creation.icosphere(subdivisions=1, radius=7.0)
    triangles = np.concatenate([tube.triangles @ turn.T, ball.triangles + np.array([4.0, 0.0, 0.0])])
    shape = (15, 16, 17)
    origin = np.array([-13.3, -14.1, -15.2])
    points = origin + 1.9 * np.moveaxis(np.indices(shape), 0, -1).reshape(-1, 3)
    ours = winding_numbers(triangles, origin, 1.9, shape)
    assert set(np.unique(ours)) == {0, 1, 2}
    wrong = points[ours.ravel() != np.rint(solid_angle_windings(triangles, points))]
    mesh = trimesh.Trimesh(**trimesh.triangles.to_kwargs(triangles))  # type: ignore[no-untyped-call]  # no types shipped
    for point in wrong:
        distance = trimesh.proximity.closest_point(mesh, point[np.newaxis])[1]  # type: ignore[no-untyped-call]  # no types
        assert distance[0] <= math.hypot(*BESIDE) * 1.9
    assert len(wrong) < 5


def test_lines_along_walls_and_edges_slip_through_nothing() -> None:
    box = trimesh.creation.box((4.0, 6.0, 8.0))
    ours = winding_numbers(np.asarray(box.triangles), np.array([-4.0, -4.0, -5.0]), 1.0, (9, 9, 11))
    inside = ours[3:6, 2:7, 2:9]
    assert (inside == 1).all()
    outside = ours.copy()
    outside[2:7, 1:8, 1:10] = 0
    assert not outside.any()


def test_a_grid_may_be_smaller_than_the_surface() -> None:
    box = np.asarray(trimesh.creation.box((40.0, 40.0, 40.0)).triangles)
    shape, origin = (3, 4, 5), np.zeros(3)
    assert (winding_numbers(box, origin, 1.0, shape) == 1).all()
    for axis in range(3):
        aside = np.zeros(3)
        aside[axis] = 50.0
        assert not winding_numbers(box + aside, origin, 1.0, shape).any()
        assert not winding_numbers(box - aside, origin, 1.0, shape).any()
