from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from planner.cell.cell import placement
from planner.errors import WorkpieceError
from planner.geometry.mesh import first_crossing, load_mesh, mesh_fault, radius_about_axis_mm


def box(size_mm: float = 100.0, x_mm: float = 0.0) -> trimesh.Trimesh:
    mesh: trimesh.Trimesh = trimesh.creation.box((size_mm, size_mm, size_mm))
    mesh.apply_translation((x_mm, 0.0, 0.0))
    return mesh


def inside_out() -> trimesh.Trimesh:
    mesh = box()
    return trimesh.Trimesh(mesh.vertices, mesh.faces[:, ::-1], process=False)


def without_a_triangle() -> trimesh.Trimesh:
    mesh = box()
    return trimesh.Trimesh(mesh.vertices, mesh.faces[1:], process=False)


def both(a: trimesh.Trimesh, b: trimesh.Trimesh) -> trimesh.Trimesh:
    faces = np.concatenate((a.faces, b.faces + len(a.vertices)))
    return trimesh.Trimesh(np.concatenate((a.vertices, b.vertices)), faces, process=False)


def crossing() -> trimesh.Trimesh:
    other = box()
    other.apply_transform(placement(60.0, 10.0, 20.0, 20.0, 30.0, 0.0))
    return both(box(), other)


@pytest.mark.parametrize("suffix", [".stl", ".ply", ".obj"])
def test_a_sound_mesh_is_loaded_in_each_format(tmp_path: Path, suffix: str) -> None:
    file = tmp_path / f"part{suffix}"
    box().export(file)
    assert load_mesh(file).volume == pytest.approx(1e6, rel=1e-6)


@pytest.mark.parametrize(
    ("mesh", "message"),
    [
        (box(0.1), r"longest side is 0.1 mm; allowed is 10 to 1000 mm; is it in metres\?"),
        (box(5000.0), "longest side is 5000 mm; allowed is 10 to 1000 mm$"),
        (without_a_triangle(), "is open"),
        (inside_out(), "inside out"),
        (crossing(), "crosses itself, at triangles"),
    ],
)
def test_a_mesh_that_cannot_be_meant_is_refused(tmp_path: Path, mesh: trimesh.Trimesh, message: str) -> None:
    file = tmp_path / "part.ply"
    mesh.export(file)
    with pytest.raises(WorkpieceError, match=message) as refusal:
        load_mesh(file)
    assert str(refusal.value).startswith(str(file))


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("empty.stl", b""),
        ("no_triangles.stl", b"solid nothing\nendsolid nothing\n"),
        ("no_faces.obj", b"v 0 0 0\nv 1 0 0\n"),
        ("broken.ply", b"ply\nformat ascii 1.0\nelement"),
        ("broken.stl", b"\x00" * 90),
        ("part.step", b""),
    ],
)
def test_a_file_without_a_mesh_is_refused(tmp_path: Path, name: str, content: bytes) -> None:
    file = tmp_path / name
    file.write_bytes(content)
    with pytest.raises(WorkpieceError, match=name):
        load_mesh(file)


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(WorkpieceError, match=r"absent.stl: cannot be read"):
        load_mesh(tmp_path / "absent.stl")


def test_separate_bodies_do_not_cross_and_overlapping_ones_do() -> None:
    tumbled = Rotation.random(rng=np.random.default_rng(1)).as_matrix()
    for x_mm, crosses in ((200.0, False), (101.0, False), (60.0, True)):
        pair = both(box(), box(x_mm=x_mm).apply_translation((0.0, 13.0, 7.0)))
        pair.vertices = pair.vertices @ tumbled.T
        assert (first_crossing(pair) is not None) == crosses


def test_boxes_that_share_the_planes_of_their_sides_are_seen_to_cross() -> None:
    assert first_crossing(both(box(), box(x_mm=60.0))) is not None


def test_the_radius_is_measured_from_the_tables_axis_where_the_mesh_is_placed() -> None:
    assert radius_about_axis_mm(box(), placement(0.0, 0.0, 50.0, 45.0, 0.0, 0.0)) == pytest.approx(50.0 * np.sqrt(2.0))
    assert radius_about_axis_mm(box(), placement(30.0, 0.0, 50.0, 0.0, 0.0, 0.0)) == pytest.approx(np.hypot(80.0, 50.0))


def test_a_fine_closed_mesh_has_no_fault() -> None:
    assert mesh_fault(trimesh.creation.icosphere(subdivisions=4, radius=50.0)) is None
