import re
from collections.abc import Callable

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from planner.arrays import FloatArray, IndexArray
from planner.errors import WorkpieceError
from planner.geometry.closed_surface import ClosedSurface, closed_surface

Soup = tuple[FloatArray, IndexArray]


def block(x: float = 0.0, y: float = 0.0, z: float = 0.0, side_mm: float = 60.0) -> Soup:
    mesh = trimesh.creation.box((side_mm, side_mm, side_mm))
    return np.add(mesh.vertices, (x, y, z)), np.asarray(mesh.faces)


def mirrored(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Soup:
    """A block whose faces across x are split like those of the adjacent block."""
    vertices, faces = block()
    return np.add(vertices * (-1.0, 1.0, 1.0), (x, y, z)), faces[:, ::-1]


def together(*parts: Soup) -> Soup:
    offsets = np.cumsum([0, *(len(vertices) for vertices, _ in parts)])
    faces = np.concatenate([faces + offset for (_, faces), offset in zip(parts, offsets, strict=False)])
    return np.concatenate([vertices for vertices, _ in parts]), faces


def loose(vertices: FloatArray, faces: IndexArray) -> Soup:
    """Each triangle has its own corners, as in STL."""
    return vertices[faces].reshape(-1, 3), np.arange(faces.size).reshape(-1, 3)


def volume(surface: ClosedSurface) -> float:
    mesh = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
    assert mesh.is_winding_consistent
    return float(mesh.volume)


def plus(*faces: tuple[int, int, int], corners: tuple[tuple[float, float, float], ...] = ()) -> Soup:
    """A block with more triangles, and more corners for them to use."""
    vertices, given = block()
    return np.vstack((vertices, *corners)), np.vstack((given, faces))


FIRST = tuple(int(corner) for corner in block()[1][0])
A, B, C = FIRST
MIDDLE = tuple((block()[0][A] + block()[0][B]) / 2)

FLAWS: dict[str, tuple[Soup, str]] = {
    "a corner twice in a triangle": (plus((0, 0, 5)), "left out 1 triangle without area"),
    "a triangle that is a point": (plus((3, 3, 3), (2, 2, 2)), "left out 2 triangles without area"),
    "a triangle that is a line": (plus((A, B, 8), corners=(MIDDLE,)), "left out 1 triangle without area"),
    "a triangle twice": (plus((A, B, C)), "left out 1 repeated triangle"),
    "a triangle three times": (plus((A, B, C), (B, C, A)), "left out 2 repeated triangles"),
    "a triangle from both sides": (plus((C, B, A)), "left out 1 repeated triangle"),
    "a body twice": (together(block(), block()), "left out 12 repeated triangles"),
    "one triangle inside out": (
        (block()[0], np.where(np.arange(12)[:, None] == 4, block()[1][:, ::-1], block()[1])),
        "turned 1 inside-out triangle",
    ),
    "all inside out": ((block()[0], block()[1][:, ::-1]), "turned 12 inside-out triangles"),
}


@pytest.mark.parametrize("flaw", FLAWS)
@pytest.mark.parametrize("layout", [lambda *soup: soup, loose], ids=["corners shared", "corners loose"])
def test_a_harmless_flaw_is_mended_and_said_with_its_number(flaw: str, layout: Callable[..., Soup]) -> None:
    soup, note = FLAWS[flaw]
    surface = closed_surface(*layout(*soup))
    assert volume(surface) == pytest.approx(60.0**3)
    assert surface.notes == (note,)


def test_a_sound_surface_is_left_alone() -> None:
    assert closed_surface(*loose(*block())).notes == ()


TOUCHING = {
    "a corner": ((60.0, 60.0, 60.0), 2 * 60.0**3),
    "an edge": ((60.0, 60.0, 0.0), 2 * 60.0**3),
    "a face": ((60.0, 0.0, 0.0), 2 * 60.0**3),
    "part of an edge": ((60.0, 60.0, 20.0), 2 * 60.0**3),
    "part of a face": ((60.0, 20.0, 10.0), 2 * 60.0**3),
}


@pytest.mark.parametrize("shared", TOUCHING)
@pytest.mark.parametrize("inside_out", [False, True])
def test_bodies_may_share(shared: str, inside_out: bool) -> None:
    place, total_mm3 = TOUCHING[shared]
    vertices, faces = mirrored(*place)
    other = vertices, faces[:, ::-1] if inside_out else faces
    assert volume(closed_surface(*loose(*together(block(), other)))) == pytest.approx(total_mm3)


def test_bodies_that_share_a_face_become_one_without_the_wall_between_them() -> None:
    row = together(block(), mirrored(60.0), block(120.0))
    surface = closed_surface(*loose(*row))
    assert len(surface.faces) == 3 * 12 - 2 * 4
    assert surface.notes == ("left out 8 repeated triangles",)


def test_a_shared_face_that_each_body_splits_its_own_way_is_no_hole() -> None:
    surface = closed_surface(*loose(*together(block(), block(60.0))))
    assert volume(surface) == pytest.approx(2 * 60.0**3)
    assert surface.notes == ()


@settings(deadline=None, max_examples=30)
@given(
    kept=st.sets(st.tuples(st.integers(0, 2), st.integers(0, 2), st.integers(0, 1)), min_size=1),
    seed=st.integers(0, 1000),
)
def test_any_heap_of_blocks_has_the_volume_of_its_blocks(kept: set[tuple[int, int, int]], seed: int) -> None:
    """Blocks of a grid, tumbled and rounded to single precision as in STL: corners, edges and faces are shared."""
    turn = Rotation.random(random_state=seed).as_matrix()
    vertices, faces = loose(
        *together(*(block(20.0 * cell[0], 20.0 * cell[1], 20.0 * cell[2], 20.0) for cell in sorted(kept)))
    )
    surface = closed_surface((vertices @ turn.T).astype(np.float32).astype(np.float64), faces)
    assert volume(surface) == pytest.approx(len(kept) * 20.0**3, rel=1e-4)


@settings(deadline=None, max_examples=30)
@given(seed=st.integers(0, 10_000), size_mm=st.floats(10.0, 1000.0))
def test_corners_that_only_rounding_keeps_apart_are_joined(seed: int, size_mm: float) -> None:
    mesh = trimesh.creation.icosphere(subdivisions=2, radius=size_mm / 2)
    vertices, faces = loose(np.asarray(mesh.vertices), np.asarray(mesh.faces))
    noise = np.random.default_rng(seed).uniform(-1.0, 1.0, vertices.shape) * 1e-6 * size_mm
    surface = closed_surface(vertices + noise, faces)
    assert volume(surface) == pytest.approx(mesh.volume, rel=1e-4)
    assert surface.notes[0] == f"joined {len(vertices) - len(mesh.vertices)} corners that only rounding keeps apart"


@pytest.mark.parametrize("missing", range(12))
def test_a_hole_is_refused_with_its_place(missing: int) -> None:
    vertices, faces = block(100.0, 0.0, 0.0)
    with pytest.raises(WorkpieceError, match=r"the mesh is open at 3 edges, the first near x ") as refusal:
        closed_surface(*loose(vertices, np.delete(faces, missing, axis=0)))
    place = re.findall(r"[xyz] (-?\d+\.\d+)", str(refusal.value))
    corners = vertices[faces[missing]]
    middles = (corners + np.roll(corners, 1, axis=0)) / 2
    assert np.abs(middles - np.array(place, dtype=float)).sum(axis=1).min() < 0.01


def test_triangles_without_area_alone_make_no_surface() -> None:
    with pytest.raises(WorkpieceError, match="no triangle with a nonzero area"):
        closed_surface(block()[0], np.array([[0, 0, 1], [2, 2, 2]]))
