import math
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from planner.geometry.signed_distance_field import (
    SignedDistanceField,
    build_field,
    cached_field,
    field_distance,
    look_up,
)

SPACING_MM = 4.0
HALF_DIAGONAL_MM = SPACING_MM * 3**0.5 / 2
coordinate = st.integers(-70, 70).map(float)
point = st.tuples(coordinate, coordinate, coordinate)


@cache
def mould() -> trimesh.Trimesh:
    """A short tube: concave, with sharp edges."""
    mesh: trimesh.Trimesh = trimesh.creation.annulus(r_min=25.0, r_max=50.0, height=40.0, sections=24)
    return mesh


@cache
def field() -> SignedDistanceField:
    return build_field(mould(), SPACING_MM)


def exact_distances(points: NDArray[np.float64], mesh: trimesh.Trimesh | None = None) -> NDArray[np.float64]:
    mesh = mesh or mould()
    return -np.asarray(trimesh.proximity.signed_distance(mesh, points))  # type: ignore[no-untyped-call]  # no types


def walked(a: tuple[float, ...], b: tuple[float, ...], enough_mm: float = math.inf) -> float:
    return between(field(), a, b, enough_mm)


def between(field: SignedDistanceField, a: Sequence[float], b: Sequence[float], enough_mm: float) -> float:
    (ax, ay, az), (bx, by, bz) = a, b
    return field_distance(*field, ax, ay, az, bx, by, bz, enough_mm)


def hollow_box() -> trimesh.Trimesh:
    hole = trimesh.creation.icosphere(subdivisions=2, radius=20.0)
    hole.invert()
    return joined(trimesh.creation.box((60.0, 60.0, 60.0)), hole)


def joined(*shells: trimesh.Trimesh) -> trimesh.Trimesh:
    mesh = trimesh.util.concatenate(shells)
    assert isinstance(mesh, trimesh.Trimesh)
    return mesh


PARTS: dict[str, Callable[[], trimesh.Trimesh]] = {
    "convex": lambda: trimesh.creation.icosphere(subdivisions=3, radius=30.0),
    "concave": mould,
    "round and concave": lambda: trimesh.creation.torus(40.0, 12.0, 16, 12),
    "thinner than the spacing": lambda: trimesh.creation.box((60.0, 50.0, 1.5)),
    "walls on the grid's lines": lambda: trimesh.creation.box((40.0, 32.0, 24.0)),
    "hollow": hollow_box,
}


def test_a_field_built_by_other_rules_is_not_read_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = trimesh.creation.box((20, 30, 40))
    monkeypatch.setattr("planner.geometry.signed_distance_field._RULES", b"older")
    cached_field(mesh, 5.0, folder=tmp_path)
    monkeypatch.undo()
    cached_field(mesh, 5.0, folder=tmp_path)
    assert len(list(tmp_path.iterdir())) == 2


def grid_points(field: SignedDistanceField) -> NDArray[np.float64]:
    """The points of all grids, in the order of the values."""
    grids = [
        level[:3] + level[3] * np.moveaxis(np.indices(level[4:].astype(int)), 0, -1).reshape(-1, 3)
        for level in field.levels
    ]
    return np.concatenate(grids)


@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize("turned_deg", [0.0, 35.0])
def test_the_grid_holds_the_distance_that_trimesh_finds(part: str, turned_deg: float) -> None:
    mesh = PARTS[part]().copy()
    turn = np.eye(4)
    turn[:3, :3] = Rotation.from_rotvec([turned_deg, 0.3 * turned_deg, 0.7 * turned_deg], degrees=True).as_matrix()
    mesh.apply_transform(turn)
    built = build_field(mesh, SPACING_MM)
    rng = np.random.default_rng(0)
    assert len(built.levels) > 1
    chosen = rng.permutation(built.values_mm.size)[:1500]
    exact = exact_distances(grid_points(built)[chosen], mesh)
    excess = built.values_mm[chosen] - exact
    assert excess.max() <= 1e-4
    assert excess.min() >= -0.002 * built.levels[-1, 3]
    assert excess[chosen < built.finest()[0].size].min() >= -0.002 * SPACING_MM


def test_what_two_overlapping_shells_share_is_inside() -> None:
    ball = trimesh.creation.icosphere(subdivisions=2, radius=20.0)
    both = joined(ball, ball.copy().apply_translation((15.0, 0.0, 0.0)))
    assert look_up(*build_field(both, SPACING_MM), 7.5, 0.0, 0.0) < 0.0


def test_of_two_bodies_that_share_a_face_the_one_that_is_inside_out_is_matter_too() -> None:
    left, right = trimesh.creation.box((50.0, 80.0, 60.0)), trimesh.creation.box((50.0, 80.0, 60.0))
    left.apply_translation((-25.0, 0.0, 0.0))
    right.apply_translation((25.0, 0.0, 0.0))
    right.invert()
    built = build_field(joined(left, right), SPACING_MM)
    for x in (-25.0, 25.0):
        assert look_up(*built, x, 0.0, 0.0) < -20.0
    assert look_up(*built, 60.0, 0.0, 0.0) > 0.0


@pytest.mark.parametrize("part", PARTS)
def test_a_look_up_is_never_above_the_distance_and_at_most_a_cells_diagonal_below(part: str) -> None:
    mesh = PARTS[part]()
    built = build_field(mesh, SPACING_MM)
    rng = np.random.default_rng(0)
    points = rng.uniform(mesh.bounds[0] - SPACING_MM, mesh.bounds[1] + SPACING_MM, (500, 3))
    below = exact_distances(points, mesh) - [look_up(*built, *map(float, p)) for p in points]
    assert below.min() >= -1e-4
    assert below.max() <= 2.0 * HALF_DIAGONAL_MM + 0.002 * SPACING_MM


@pytest.mark.parametrize("part", PARTS)
def test_a_look_up_off_the_part_is_little_below_the_distance(part: str) -> None:
    """In the coarser grids, and far beyond the last one."""
    mesh = PARTS[part]()
    built = build_field(mesh, SPACING_MM)
    rng = np.random.default_rng(0)
    points = rng.uniform(-160.0, 160.0, (400, 3))
    exact = exact_distances(points, mesh)
    points, exact = points[exact > 20.0], exact[exact > 20.0]
    below = exact - [look_up(*built, *map(float, p)) for p in points]
    assert below.min() >= -1e-4
    assert below.max() <= 2.0 * SPACING_MM
    assert np.median(below) <= 0.5 * SPACING_MM
    far = 2000.0 * rng.normal(size=(20, 3))
    far_below = exact_distances(far, mesh) - [look_up(*built, *map(float, p)) for p in far]
    assert far_below.min() >= -1e-3


@settings(deadline=None)
@given(a=point, b=point)
def test_a_segment_is_never_nearer_than_the_field_says(a: tuple[float, ...], b: tuple[float, ...]) -> None:
    exact = exact_distances(np.linspace(a, b, 100))
    ours = walked(a, b)
    assert ours <= exact.min()


def test_every_walk_ends_near_the_least_distance_on_its_way() -> None:
    rng = np.random.default_rng(0)
    for a, b in rng.uniform(-60.0, 60.0, (2000, 2, 3)):
        along = np.linspace(a, b, 50)
        met = min(look_up(*field(), *map(float, p)) for p in along)
        assert walked(tuple(a), tuple(b), 30.0) <= met + 2.0 * HALF_DIAGONAL_MM
        assert walked(tuple(a), tuple(b), 30.0) >= min(met, 30.0) - 2.0 * SPACING_MM


@settings(deadline=None)
@given(a=point, b=point, enough_mm=st.floats(-10, 60))
def test_a_bound_keeps_what_is_below_it(a: tuple[float, ...], b: tuple[float, ...], enough_mm: float) -> None:
    exact, bounded = walked(a, b), walked(a, b, enough_mm)
    if exact < enough_mm - 0.25 * SPACING_MM:
        assert bounded == pytest.approx(exact, abs=0.25 * SPACING_MM)
    else:
        assert bounded >= enough_mm - 0.5 * SPACING_MM
    if exact >= enough_mm:
        assert bounded >= enough_mm


@settings(deadline=None, max_examples=300)
@given(
    spacing_mm=st.floats(1e-3, 100.0),
    enough_mm=st.floats(-10.0, 500.0),
    a=point,
    b=point,
)
def test_a_free_segment_gets_at_least_what_was_asked_for_any_spacing(
    spacing_mm: float, enough_mm: float, a: tuple[float, ...], b: tuple[float, ...]
) -> None:
    far = SignedDistanceField(np.full(27, 1e4, np.float32), np.array([[0.0, 0.0, 0.0, spacing_mm, 3.0, 3.0, 3.0]]))
    assert between(far, a, b, enough_mm) >= enough_mm


def random_part(kind: str, sizes_mm: tuple[float, float, float]) -> trimesh.Trimesh:
    mesh: trimesh.Trimesh
    if kind == "box":
        mesh = trimesh.creation.box(sizes_mm)
    elif kind == "cylinder":
        mesh = trimesh.creation.cylinder(radius=sizes_mm[0] / 2, height=sizes_mm[1], sections=12)
    else:
        mesh = trimesh.creation.icosphere(subdivisions=1, radius=sizes_mm[0] / 2)
    return mesh


size = st.floats(10.0, 400.0)


@settings(deadline=None, max_examples=30)
@given(
    kind=st.sampled_from(["box", "cylinder", "sphere"]),
    sizes_mm=st.tuples(size, size, size),
    place_mm=st.tuples(coordinate, coordinate, coordinate),
    points=st.integers(200, 1500),
    enough_mm=st.sampled_from([2.0, 5.0, 30.0, 47.3]),
    seed=st.integers(0, 1000),
)
def test_any_part_on_any_grid_blocks_no_segment_that_is_free_of_it(
    kind: str,
    sizes_mm: tuple[float, float, float],
    place_mm: tuple[float, float, float],
    points: int,
    enough_mm: float,
    seed: int,
) -> None:
    """A segment beside the part's box, at the requested distance plus 2.5 grid spacings."""
    mesh = random_part(kind, sizes_mm)
    mesh.apply_translation(place_mm)
    field = build_field(mesh, float(np.cbrt(np.prod(mesh.extents) / points)))
    rng = np.random.default_rng(seed)
    off_mm = enough_mm + 2.5 * field.spacing_mm
    for axis in range(3):
        a, b = rng.uniform(mesh.bounds[0] - 50.0, mesh.bounds[1] + 50.0, (2, 3))
        a[axis] = b[axis] = mesh.bounds[1, axis] + off_mm
        assert between(field, a.tolist(), b.tolist(), enough_mm) >= enough_mm


def test_a_field_is_built_once_and_read_back_the_same(tmp_path: Path) -> None:
    mesh = trimesh.creation.box((20, 30, 40))
    calls: list[tuple[int, int]] = []
    built = cached_field(mesh, 5.0, lambda *done: calls.append(done), tmp_path)
    assert calls[-1][0] == calls[-1][1] == built.values_mm.size
    calls.clear()
    read = cached_field(mesh, 5.0, lambda *done: calls.append(done), tmp_path)
    assert not calls
    assert np.array_equal(built.values_mm, read.values_mm)
    assert np.array_equal(built.levels, read.levels)


def test_another_shape_or_spacing_is_another_field(tmp_path: Path) -> None:
    for lengths, spacing in (((20, 30, 40), 5.0), ((20, 30, 41), 5.0), ((20, 30, 40), 6.0)):
        cached_field(trimesh.creation.box(lengths), spacing, folder=tmp_path)
    assert len(list(tmp_path.iterdir())) == 3


def test_a_damaged_field_is_built_anew(tmp_path: Path) -> None:
    mesh = trimesh.creation.box((20, 30, 40))
    built = cached_field(mesh, 5.0, folder=tmp_path)
    (file,) = tmp_path.iterdir()
    file.write_bytes(file.read_bytes()[:100])
    assert np.array_equal(cached_field(mesh, 5.0, folder=tmp_path).values_mm, built.values_mm)


@pytest.mark.parametrize("spacing_mm", [0.0, -1.0, float("nan"), 0.01])
def test_a_spacing_that_cannot_be_meant_is_refused(spacing_mm: float) -> None:
    with pytest.raises(ValueError, match="mm"):
        build_field(trimesh.creation.box((20, 30, 40)), spacing_mm)
