from pathlib import Path

import numpy as np
import pytest
import trimesh

from planner.cell.cell import placement
from planner.errors import WorkpieceError
from planner.geometry.mesh import load_mesh, radius_about_axis_mm


def box(size_mm: float = 100.0) -> trimesh.Trimesh:
    mesh: trimesh.Trimesh = trimesh.creation.box((size_mm, size_mm, size_mm))
    return mesh


def without_a_triangle() -> trimesh.Trimesh:
    mesh = box()
    return trimesh.Trimesh(mesh.vertices, mesh.faces[1:], process=False)


def crossing() -> trimesh.Trimesh:
    other = box()
    other.apply_transform(placement(60.0, 10.0, 20.0, 20.0, 30.0, 0.0))
    mesh = trimesh.util.concatenate((box(), other))
    assert isinstance(mesh, trimesh.Trimesh)
    return mesh


def with_a_corner_at(x_mm: float) -> trimesh.Trimesh:
    mesh = box()
    vertices = np.array(mesh.vertices)
    vertices[0, 0] = x_mm
    return trimesh.Trimesh(vertices, mesh.faces, process=False)


def saved(mesh: trimesh.Trimesh, file: Path) -> Path:
    mesh.export(file)
    return file


@pytest.mark.parametrize("suffix", [".stl", ".ply", ".obj"])
def test_a_sound_mesh_is_loaded_in_each_format(tmp_path: Path, suffix: str) -> None:
    assert load_mesh(saved(box(), tmp_path / f"part{suffix}")).volume == pytest.approx(1e6, rel=1e-6)


@pytest.mark.parametrize(
    ("mesh", "message"),
    [
        (box(0.1), r"longest side is 0.1 mm; allowed: 10 to 1000 mm; is it in meters\?"),
        (box(0.5), r"longest side is 0.5 mm; .* is it in meters or inches\?"),
        (box(1.0), r"longest side is 1 mm; .* is it in meters or centimeters or inches\?"),
        (
            box(8.0),
            r"longest side is 8 mm; .* is it in centimeters or inches\? Then set unit in \[workpiece\], or --unit",
        ),
        (box(0.001), "allowed: 10 to 1000 mm$"),
        (box(5000.0), "longest side is 5000 mm; allowed: 10 to 1000 mm$"),
        (without_a_triangle(), "is open at 3 edges, the first near x "),
        (crossing(), r"crosses itself near x -?\d+"),
        (with_a_corner_at(np.nan), "a coordinate that is not a finite number"),
        (with_a_corner_at(np.inf), "a coordinate that is not a finite number"),
        (trimesh.Trimesh(box().vertices, np.zeros((0, 3), dtype=int), process=False), "the mesh is empty"),
    ],
)
def test_a_mesh_that_cannot_be_meant_is_refused(tmp_path: Path, mesh: trimesh.Trimesh, message: str) -> None:
    file = saved(mesh, tmp_path / "part.ply")
    with pytest.raises(WorkpieceError, match=message) as refusal:
        load_mesh(file)
    assert str(refusal.value).startswith(str(file))


@pytest.mark.parametrize(("unit", "mm"), [("mm", 1.0), ("cm", 10.0), ("m", 1000.0), ("inch", 25.4)])
def test_a_unit_that_is_said_settles_the_size(tmp_path: Path, unit: str, mm: float) -> None:
    file = saved(box(100.0 / mm), tmp_path / "part.ply")
    np.testing.assert_allclose(load_mesh(file, unit).extents, 100.0, rtol=1e-6)


def test_a_size_that_the_said_unit_does_not_mend_is_not_asked_about_again(tmp_path: Path) -> None:
    with pytest.raises(WorkpieceError, match=r"longest side is 5 mm; allowed: 10 to 1000 mm$"):
        load_mesh(saved(box(5.0), tmp_path / "part.stl"), "mm")


def test_what_is_mended_is_said_in_one_line(tmp_path: Path) -> None:
    mesh = box()
    mesh.invert()
    file = saved(mesh, tmp_path / "part.stl")
    file.write_bytes(file.read_bytes() + b"more")
    said: list[str] = []
    assert load_mesh(file, say=said.append).volume == pytest.approx(1e6)
    assert said == [f"{file}: ignored 4 bytes after the last triangle; turned 12 inside-out triangles"]


def test_a_sound_mesh_is_loaded_without_a_word(tmp_path: Path) -> None:
    said: list[str] = []
    load_mesh(saved(trimesh.creation.icosphere(subdivisions=4, radius=50.0), tmp_path / "part.stl"), say=said.append)
    assert said == []


def test_the_radius_is_measured_from_the_tables_axis_where_the_mesh_is_placed() -> None:
    assert radius_about_axis_mm(box(), placement(0.0, 0.0, 50.0, 45.0, 0.0, 0.0)) == pytest.approx(50.0 * np.sqrt(2.0))
    assert radius_about_axis_mm(box(), placement(30.0, 0.0, 50.0, 0.0, 0.0, 0.0)) == pytest.approx(np.hypot(80.0, 50.0))
