from functools import cache
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.signed_distance_field import (
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
    return trimesh.creation.annulus(r_min=25.0, r_max=50.0, height=40.0, sections=24)


@cache
def field() -> SignedDistanceField:
    return build_field(mould(), SPACING_MM)


def test_within_its_grid_a_field_is_half_a_cell_off_at_most() -> None:
    rng = np.random.default_rng(0)
    points = rng.uniform(*mould().bounds, (2000, 3))
    exact = -trimesh.proximity.signed_distance(mould(), points)
    ours = np.array([look_up(*field(), *map(float, p)) for p in points])
    assert np.abs(ours - exact).max() <= HALF_DIAGONAL_MM
    assert np.median(np.abs(ours - exact)) < 0.05 * SPACING_MM


def test_beyond_its_grid_a_field_never_promises_too_much() -> None:
    rng = np.random.default_rng(0)
    points = rng.uniform(-300, 300, (2000, 3))
    exact = -trimesh.proximity.signed_distance(mould(), points)
    ours = np.array([look_up(*field(), *map(float, p)) for p in points])
    assert (ours <= exact + HALF_DIAGONAL_MM).all()
    assert (exact - ours <= field().values_mm.max() + HALF_DIAGONAL_MM).all()


@settings(deadline=None)
@given(a=point, b=point)
def test_a_segment_is_never_nearer_than_the_field_says(a: tuple[float, ...], b: tuple[float, ...]) -> None:
    exact = -trimesh.proximity.signed_distance(mould(), np.linspace(a, b, 100))
    ours = field_distance(*field(), *a, *b, float("inf"))
    assert ours <= exact.min()


@settings(deadline=None)
@given(a=point, b=point, enough_mm=st.floats(-10, 60))
def test_a_bound_keeps_what_is_below_it(a: tuple[float, ...], b: tuple[float, ...], enough_mm: float) -> None:
    exact, bounded = field_distance(*field(), *a, *b, float("inf")), field_distance(*field(), *a, *b, enough_mm)
    if exact < enough_mm - 0.25 * SPACING_MM:
        assert bounded == pytest.approx(exact, abs=0.25 * SPACING_MM)
    assert bounded <= enough_mm + 1e-9


def test_a_field_is_built_once_and_read_back_the_same(tmp_path: Path) -> None:
    mesh = trimesh.creation.box((20, 30, 40))
    calls: list[tuple[int, int]] = []
    built = cached_field(mesh, 5.0, lambda *done: calls.append(done), tmp_path)
    assert calls[-1][0] == calls[-1][1] == built.values_mm.size
    calls.clear()
    read = cached_field(mesh, 5.0, lambda *done: calls.append(done), tmp_path)
    assert not calls
    assert all(np.array_equal(*pair) for pair in zip(built, read, strict=True))


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
