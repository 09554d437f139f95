from pathlib import Path

import numpy as np
import pytest
import trimesh

from planner.scanning.surface_mesh import save_surface, surface_mesh

# gpytoolbox imports deprecated names of scipy and numpy.
pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")

DIRECTIONS = np.asarray(trimesh.creation.icosphere(subdivisions=5).vertices)
RADIUS_MM = 30.0


def test_the_surface_goes_through_the_cloud(tmp_path: Path) -> None:
    surface = surface_mesh(RADIUS_MM * DIRECTIONS, DIRECTIONS, 1.0)
    save_surface(tmp_path / "mesh.ply", surface)
    mesh = trimesh.load(tmp_path / "mesh.ply")
    assert isinstance(mesh, trimesh.Trimesh)
    assert np.linalg.norm(mesh.vertices, axis=1) == pytest.approx(RADIUS_MM, abs=0.1)
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(4.0 / 3.0 * np.pi * RADIUS_MM**3, rel=0.01)  # not inside out
    assert surface.made_up == 0.0


def test_what_nobody_measured_is_left_open() -> None:
    seen = DIRECTIONS[DIRECTIONS[:, 2] > -0.5]
    surface = surface_mesh(RADIUS_MM * seen, seen, 1.0)
    assert surface.vertices[:, 2].min() > -0.5 * RADIUS_MM - 5.0
    assert surface.made_up > 0.1
    area = trimesh.Trimesh(surface.vertices, surface.faces, process=False).area
    assert area == pytest.approx(2.0 * np.pi * RADIUS_MM**2 * 1.5, rel=0.1)
