import coal
import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from planner.arrays import FloatArray
from planner.geometry.box_distance import FIELD, FIELD_TOLERANCE_MM, box_distance_bound
from planner.geometry.signed_distance_field import NO_FIELD, SignedDistanceField, build_field, look_up
from planner.geometry.solid import BOX, CAPSULE, CYLINDER

FAR = float("inf")
DIAGONAL_MM = 4.0 * 3**0.5
SIZES = {BOX: (40.0, 60.0, 15.0), CYLINDER: (50.0, 20.0, 0.0), CAPSULE: (30.0, 45.0, 0.0)}
SOLIDS = {BOX: coal.Box(80.0, 120.0, 30.0), CYLINDER: coal.Cylinder(50.0, 40.0), CAPSULE: coal.Capsule(30.0, 90.0)}
HALF_MM = np.array([25.0, 75.0, 40.0])
TUBE = build_field(trimesh.creation.annulus(r_min=40.0, r_max=70.0, height=60.0, sections=24), 4.0)


def bound(
    kind: int,
    turn: FloatArray,
    place: FloatArray,
    enough_mm: float = FAR,
    half_mm: FloatArray = HALF_MM,
    field: SignedDistanceField = NO_FIELD,
) -> float:
    (ux, uy, uz), (vx, vy, vz), (wx, wy, wz) = (turn * half_mm).T.tolist()
    x, y, z = place.tolist()
    a, b, c = SIZES.get(kind, (0.0, 0.0, 0.0))
    return box_distance_bound(kind, a, b, c, *field, x, y, z, ux, uy, uz, vx, vy, vz, wx, wy, wz, enough_mm)


def random_boxes(count: int, seed: int) -> list[tuple[FloatArray, FloatArray]]:
    turns = Rotation.random(count, random_state=seed).as_matrix()
    places = np.random.default_rng(seed).uniform(-220.0, 220.0, (count, 3))
    return list(zip(turns, places, strict=True))


@pytest.mark.parametrize("kind", [BOX, CYLINDER, CAPSULE])
def test_a_box_is_as_far_from_a_solid_as_coal_says(kind: int) -> None:
    request, free = coal.DistanceRequest(), 0
    request.gjk_tolerance = 1e-9
    for turn, place in random_boxes(400, seed=kind):
        oracle = coal.distance(
            coal.Box(*(2.0 * HALF_MM)), coal.Transform3s(turn, place),
            SOLIDS[kind], coal.Transform3s.Identity(), request, coal.DistanceResult(),
        )  # fmt: skip
        ours = bound(kind, turn, place)
        if oracle > 0.0:
            free += 1
            assert oracle - 1.2e-3 <= ours <= oracle + 1e-4
        else:
            assert ours <= 1e-4
    assert free > 150


@pytest.mark.parametrize("kind", [BOX, CYLINDER, CAPSULE])
@settings(deadline=None, max_examples=50)
@given(seed=st.integers(0, 10_000), enough_mm=st.floats(-20.0, 200.0))
def test_a_bound_never_changes_a_distance_below_it(kind: int, seed: int, enough_mm: float) -> None:
    for turn, place in random_boxes(3, seed):
        exact, bounded = bound(kind, turn, place), bound(kind, turn, place, enough_mm)
        if exact < 0.0:
            assert bounded <= max(0.5 * exact, enough_mm)
        elif exact < enough_mm:
            assert bounded == pytest.approx(exact, abs=2e-3)
        else:
            assert bounded >= enough_mm


@settings(deadline=None, max_examples=30)
@given(seed=st.integers(0, 10_000), enough_mm=st.floats(-20.0, 100.0))
def test_a_bound_never_changes_a_distance_from_a_field_below_it(seed: int, enough_mm: float) -> None:
    for turn, place in random_boxes(3, seed):
        exact, bounded = (bound(FIELD, turn, place, each, field=TUBE) for each in (FAR, enough_mm))
        if exact < enough_mm:
            assert bounded == exact
        else:
            assert bounded >= enough_mm


def test_a_box_is_as_far_from_a_field_as_the_points_in_it_say() -> None:
    inside = np.random.default_rng(0).uniform(-1.0, 1.0, (4000, 3))
    faces = inside.copy()
    faces[np.arange(4000), np.arange(4000) % 3] = np.sign(faces[np.arange(4000), np.arange(4000) % 3])
    near = 0
    for turn, place in random_boxes(60, seed=5):
        half_mm = np.array([12.0, 20.0, 8.0])
        points = (faces * half_mm) @ turn.T + place
        seen = min(look_up(*TUBE, *map(float, point)) for point in points)
        ours = bound(FIELD, turn, place, half_mm=half_mm, field=TUBE)
        assert ours <= seen + DIAGONAL_MM  # cells of the finest grid: the error of a look-up
        if seen > 0.0:
            near += 1
            assert (
                ours >= seen - FIELD_TOLERANCE_MM - DIAGONAL_MM
            )  # between the points the distance may be smaller still
    assert near > 20


def test_a_free_box_gets_what_was_asked() -> None:
    for enough_mm in (0.1, 5.0, 30.3):
        assert bound(CAPSULE, np.eye(3), np.array([500.0, 0.0, 0.0]), enough_mm) >= enough_mm
