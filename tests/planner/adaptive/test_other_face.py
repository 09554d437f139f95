import numpy as np
import pytest
import trimesh

from planner.adaptive.other_face import other_face
from planner.adaptive.visibility import Places
from planner.errors import WorkpieceError

DOWN = np.array((0.0, 0.0, -1.0))


def underside(mesh: trimesh.Trimesh) -> Places:
    down = np.asarray(mesh.face_normals)[:, 2] < -0.9
    return Places(np.asarray(mesh.triangles_center)[down], np.asarray(mesh.face_normals)[down])


@pytest.mark.parametrize("sides", [(60.0, 40.0, 20.0), (30.0, 30.0, 60.0)])
def test_a_box_is_laid_so_that_its_underside_can_be_seen(sides: tuple[float, float, float]) -> None:
    mesh = trimesh.creation.box(sides)
    mesh.apply_translation((12.0, -7.0, 0.5 * sides[2] + 3.0))
    unseen = underside(mesh)
    T = other_face(mesh, unseen)
    assert (unseen.normals @ T[:3, :3].T)[:, 2].min() > -0.2
    assert np.linalg.det(T[:3, :3]) == pytest.approx(1.0)
    lower, upper = np.asarray(mesh.bounds)
    mesh.apply_transform(T)
    new_lower, new_upper = np.asarray(mesh.bounds)
    assert new_lower[2] == pytest.approx(lower[2])
    assert 0.5 * (new_lower + new_upper)[:2] == pytest.approx(0.5 * (lower + upper)[:2])


def test_the_part_rests_on_a_face_of_its_hull() -> None:
    mesh = trimesh.creation.cone(radius=30.0, height=50.0, sections=24)
    T = other_face(mesh, underside(mesh))
    mesh.apply_transform(T)
    on_table = np.asarray(mesh.vertices)[:, 2] < np.asarray(mesh.bounds)[0, 2] + 1e-6
    assert on_table.sum() >= 3


def test_a_part_that_stands_on_one_face_only_is_refused() -> None:
    mesh = trimesh.creation.cone(radius=100.0, height=8.0, sections=64)
    with pytest.raises(WorkpieceError, match="stands stably on no other face"):
        other_face(mesh, underside(mesh))
