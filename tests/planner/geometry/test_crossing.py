import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from planner.geometry.crossing import first_crossing


def box(x_mm: float = 0.0, y_mm: float = 0.0, z_mm: float = 0.0) -> trimesh.Trimesh:
    mesh: trimesh.Trimesh = trimesh.creation.box((100.0, 100.0, 100.0))
    mesh.apply_translation((x_mm, y_mm, z_mm))
    return mesh


def both(a: trimesh.Trimesh, b: trimesh.Trimesh) -> trimesh.Trimesh:
    mesh = trimesh.util.concatenate((a, b))
    assert isinstance(mesh, trimesh.Trimesh)
    return mesh


@settings(deadline=None, max_examples=30)
@given(
    x_mm=st.floats(-150.0, 150.0),
    y_mm=st.floats(-40.0, 40.0),
    z_mm=st.floats(-40.0, 40.0),
    seed=st.integers(0, 100),
)
def test_separate_bodies_do_not_cross_and_overlapping_ones_do(x_mm: float, y_mm: float, z_mm: float, seed: int) -> None:
    offsets = np.abs([x_mm, y_mm, z_mm])
    if (offsets < 1.0).any() or abs(offsets[0] - 100.0) < 1e-3:
        return  # coincident walls have no crossing edges, or touch
    pair = both(box(), box(x_mm, y_mm, z_mm))
    pair.apply_transform(trimesh.transformations.random_rotation_matrix(np.random.default_rng(seed).random(3)))
    assert (first_crossing(pair) is not None) == (abs(x_mm) < 100.0)


def test_the_place_lies_on_both_surfaces() -> None:
    turned = box(60.0, 10.0, 20.0)
    turned.vertices = turned.vertices @ Rotation.from_rotvec([0.2, 0.4, 0.6]).as_matrix()
    place = first_crossing(both(box(), turned))
    assert place is not None
    for body in (box(), turned):
        distance = trimesh.proximity.closest_point(body, place[np.newaxis])[1]  # type: ignore[no-untyped-call]  # no types
        assert distance[0] == pytest.approx(0.0, abs=1e-6)


def test_boxes_that_share_the_planes_of_their_sides_are_seen_to_cross() -> None:
    assert first_crossing(both(box(), box(60.0))) is not None
    assert first_crossing(both(box(), box(100.0))) is None


def test_a_body_may_lie_against_the_wall_of_its_cavity() -> None:
    cavity, body = box(), box()
    cavity.invert()
    cavity.vertices *= 0.8
    body.vertices *= 0.3
    body.apply_translation((25.0, 25.0, 0.0))
    assert first_crossing(both(both(box(), cavity), body)) is None


@pytest.mark.parametrize("seed", range(10))
def test_bodies_that_touch_do_not_cross_though_their_corners_are_rounded(seed: int) -> None:
    pair = both(box(), box(100.0, 13.0, 7.0))
    turn = Rotation.random(random_state=seed).as_matrix()
    pair.vertices = (pair.vertices @ turn.T).astype(np.float32).astype(np.float64)
    assert first_crossing(pair) is None
