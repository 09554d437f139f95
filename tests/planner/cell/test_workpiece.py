import dataclasses
from typing import Any

import numpy as np
import pytest

from planner.cell.workpiece import Cylinder, Mould, Sphere, Workpiece
from planner.errors import WorkpieceError
from planner.geometry.mesh import sound_mesh

SPHERE = Sphere(160.0, middle_mm=(5.0, -10.0, 20.0))
CYLINDER = Cylinder(140.0, 180.0, middle_mm=(5.0, -10.0, 20.0))
MOULD = Mould(300.0, 200.0, 80.0, 240.0, 140.0, 50.0, middle_mm=(5.0, -10.0, 20.0))


@pytest.mark.parametrize("workpiece", [SPHERE, CYLINDER, MOULD])
def test_each_class_gives_a_sound_mesh_that_measures_as_it_was_made(workpiece: Workpiece) -> None:
    mesh = workpiece.mesh()
    _, mended = sound_mesh(np.asarray(mesh.vertices), np.asarray(mesh.faces))
    assert mended == ()
    measured = dataclasses.astuple(type(workpiece).measured(mesh))
    given = dataclasses.astuple(workpiece)
    np.testing.assert_allclose(np.hstack(measured), np.hstack(given), atol=1e-6)


@pytest.mark.parametrize(
    ("workpiece", "volume_mm3"),
    [
        (SPHERE, np.pi / 6.0 * 160.0**3),
        (CYLINDER, np.pi / 4.0 * 140.0**2 * 180.0),
        (MOULD, 300.0 * 200.0 * 80.0 - 240.0 * 140.0 * 50.0),
    ],
)
def test_the_mesh_has_the_volume_of_its_dimensions(workpiece: Workpiece, volume_mm3: float) -> None:
    assert workpiece.mesh().volume == pytest.approx(volume_mm3, rel=0.005)


def test_a_block_without_a_cavity_is_no_mould() -> None:
    with pytest.raises(WorkpieceError, match="no cavity"):
        Mould.measured(CYLINDER.mesh())


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"cavity_length_mm": 300.0}, "cavity_length_mm is 300; it must be below length_mm 300"),
        ({"cavity_width_mm": 250.0}, "cavity_width_mm is 250"),
        ({"cavity_depth_mm": 80.0}, "cavity_depth_mm is 80; it must be below height_mm 80"),
    ],
)
def test_a_cavity_must_lie_within_its_block(change: dict[str, Any], message: str) -> None:
    with pytest.raises(WorkpieceError, match=message):
        dataclasses.replace(MOULD, **change)
