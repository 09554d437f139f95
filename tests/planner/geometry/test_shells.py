from collections.abc import Sequence

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from planner.errors import WorkpieceError
from planner.geometry.shells import turned_outward
from planner.geometry.signed_distance_field import build_field, look_up
from planner.geometry.winding_number import solid_angles

SIDES_MM = (96.0, 72.0, 48.0, 24.0)
"""Nested boxes; the walls between them are 12 mm thick."""
SOLID, CAVITY = False, True


def box(side_mm: float, *, inverted: bool = False, at: Sequence[float] = (0.0, 0.0, 0.0)) -> trimesh.Trimesh:
    mesh: trimesh.Trimesh = trimesh.creation.box((side_mm, side_mm, side_mm))
    mesh.apply_translation(at)
    if inverted:
        mesh.invert()
    return mesh


def together(*shells: trimesh.Trimesh) -> trimesh.Trimesh:
    mesh = trimesh.util.concatenate(shells)
    assert isinstance(mesh, trimesh.Trimesh)
    return mesh


def outward(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    turned = turned_outward(np.asarray(mesh.vertices), np.asarray(mesh.faces))
    faces = np.where(turned[:, np.newaxis], mesh.faces[:, ::-1], mesh.faces)
    return trimesh.Trimesh(mesh.vertices, faces, process=False)


def windings(mesh: trimesh.Trimesh, points: Sequence[Sequence[float]]) -> NDArray[np.float64]:
    return np.asarray(solid_angles(np.asarray(mesh.triangles), np.array(points)) / (4.0 * np.pi))


def in_walls(turn: NDArray[np.float64]) -> NDArray[np.float64]:
    """A point in each of the walls between the boxes, from outside inward, and the middle."""
    return np.array([[side / 2 - 6.0, 1.0, 2.0] for side in SIDES_MM]) @ turn.T


@settings(deadline=None, max_examples=40)
@given(
    inverted=st.tuples(st.booleans(), st.booleans()),
    flipped=st.sets(st.integers(0, 47), max_size=12),
    order=st.permutations(range(48)),
    seed=st.integers(0, 1000),
)
def test_body_cavity_body_cavity_are_told_apart_whichever_way_each_body_is_written(
    inverted: tuple[bool, bool], flipped: set[int], order: Sequence[int], seed: int
) -> None:
    """A hollow box in the cavity of another one; each may be inside out, in addition to some triangles."""
    shells = [
        box(side, inverted=cavity ^ inverted[body])
        for side, cavity, body in zip(SIDES_MM, (SOLID, CAVITY, SOLID, CAVITY), (0, 0, 1, 1), strict=True)
    ]
    turn = Rotation.random(random_state=seed).as_matrix()
    mesh = together(*shells)
    mesh.vertices = mesh.vertices @ turn.T
    faces = np.array(mesh.faces)
    per_box = {
        triangle // 12: triangle for triangle in flipped
    }  # at most one per box: the rest still determines the orientation
    faces[list(per_box.values())] = faces[list(per_box.values()), ::-1]
    mended = outward(trimesh.Trimesh(mesh.vertices, faces[list(order)], process=False))
    assert np.rint(windings(mended, in_walls(turn).tolist())).tolist() == [1, 0, 1, 0]
    sides = np.array(SIDES_MM)
    assert mended.volume == pytest.approx((sides**3) @ (1, -1, 1, -1))


@pytest.mark.parametrize("inverted", [(False, False), (False, True), (True, False), (True, True)])
def test_bodies_beside_each_other_are_both_matter(inverted: tuple[bool, bool]) -> None:
    a, b = (box(30.0, inverted=each, at=(x, 0.0, 0.0)) for each, x in zip(inverted, (-30.0, 30.0), strict=True))
    mesh = together(a, b)
    assert windings(outward(mesh), [[-30.0, 0.0, 0.0], [30.0, 0.0, 0.0]]) == pytest.approx([1.0, 1.0])
    field = build_field(mesh, 3.0)
    for x in (-30.0, 30.0):
        assert look_up(*field, x, 0.0, 0.0) == pytest.approx(-15.0, abs=1.5)


@pytest.mark.parametrize("inverted", [False, True])
def test_a_body_within_a_body_leaves_both_matter(inverted: bool) -> None:
    mended = outward(together(box(60.0, inverted=inverted), box(30.0, inverted=inverted)))
    assert (windings(mended, [[0.0, 0.0, 0.0], [22.0, 0.0, 0.0]]) > 0.5).all()


def test_a_body_in_a_cavity_is_matter_even_if_it_is_written_as_a_cavity() -> None:
    mended = outward(together(box(60.0), box(40.0, inverted=True), box(20.0, inverted=True)))
    assert windings(mended, [[0.0, 0.0, 0.0], [15.0, 0.0, 0.0], [25.0, 0.0, 0.0]]) == pytest.approx([1.0, 0.0, 1.0])


def test_a_cavity_fills_a_cavity_of_a_body_that_another_body_surrounds() -> None:
    shells = box(90.0), box(70.0), box(50.0, inverted=True)
    assert (windings(outward(together(*shells)), [[0.0, 0.0, 0.0], [30.0, 0.0, 0.0], [40.0, 0.0, 0.0]]) > 0.5).all()


@pytest.mark.parametrize("inverted", [False, True])
def test_a_body_that_touches_the_wall_of_its_cavity_is_still_inside_it(inverted: bool) -> None:
    inner = box(10.0, inverted=inverted, at=(15.0, 15.0, 15.0))  # three of its faces coincide with the cavity's
    mended = outward(together(box(60.0), box(40.0, inverted=True), inner))
    assert windings(mended, [[15.0, 15.0, 15.0], [0.0, 0.0, 0.0]]) == pytest.approx([1.0, 0.0])


def test_corners_at_one_position_are_one_corner() -> None:
    soup = box(40.0, inverted=True)
    soup.unmerge_vertices()
    assert outward(soup).volume == pytest.approx(40.0**3)


def test_a_surface_with_one_side_is_refused_with_the_place() -> None:
    # A square's cone over a Moebius band, closed by a disc: its edges are in pairs, its sides are not.
    u, v = np.meshgrid(np.arange(12), np.arange(6), indexing="ij")
    quad = np.stack((u, v), axis=-1).reshape(-1, 2)

    def corner(i: int, j: int) -> int:
        turns, i = divmod(i, 12)
        return i * 6 + ((-j) % 6 if turns else j % 6)

    faces = []
    for i, j in quad.tolist():
        a, b, c, d = corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)
        faces += [(a, b, c), (a, c, d)]
    klein = np.array(faces)
    vertices = np.random.default_rng(0).uniform(-50.0, 50.0, (72, 3))
    with pytest.raises(WorkpieceError, match=r"are oriented inconsistently, at \d+ edges, the first near x "):
        turned_outward(vertices, klein)
