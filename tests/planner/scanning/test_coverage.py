import numpy as np
import pytest
import trimesh

from planner.arrays import FloatArray
from planner.cell.cell import placement
from planner.geometry.ray_casting import RayCaster
from planner.scanning.coverage import REASONS, Coverage
from planner.scanning.probe import LaserProbe, Sight


def over(mesh: trimesh.Trimesh, T_WS: FloatArray) -> Coverage:
    coverage = Coverage(mesh, RayCaster(mesh), LaserProbe(), spacing_mm=2.0)
    for block in np.array_split(T_WS, 3):
        coverage.take(block)
    return coverage


def strips(height_mm: float, lines_x_mm: tuple[float, ...], step_mm: float = 1.0) -> FloatArray:
    """Return poses that look down and move along y, in strips with given middles in x."""
    along = np.arange(-60.0, 60.0, step_mm)
    return np.stack([placement(x, y, height_mm, 0.0, 180.0, 180.0) for x in lines_x_mm for y in along])


def box(height_mm: float = 20.0) -> trimesh.Trimesh:
    mesh: trimesh.Trimesh = trimesh.creation.box((100.0, 100.0, height_mm))
    mesh.apply_translation((0.0, 0.0, -0.5 * height_mm))
    return mesh


def test_strips_over_a_box_see_its_top_and_nothing_else() -> None:
    coverage = over(box(), strips(150.0, (-30.0, 30.0)))
    seen = coverage.codes == Sight.SEEN
    assert (seen == (coverage.normals[:, 2] > 0.5)).all()
    assert coverage.shares()[Sight.SEEN] == pytest.approx(100.0**2 / (2 * 100.0**2 + 4 * 100.0 * 20.0), abs=0.02)
    assert sum(coverage.shares().values()) == pytest.approx(1.0)


def test_one_strip_sees_as_much_as_its_line_is_wide() -> None:
    coverage = over(box(), strips(150.0, (0.0,)))
    top = coverage.normals[:, 2] > 0.5
    within = np.abs(coverage.points[:, 0]) <= 30.0
    assert (coverage.codes[top & within] == Sight.SEEN).all()
    assert (coverage.codes[top & ~within] == Sight.NEVER_IN_VIEW).all()


def test_lines_too_far_apart_leave_gaps() -> None:
    coverage = over(box(), strips(150.0, (-30.0, 30.0), step_mm=4.0))
    top = coverage.normals[:, 2] > 0.5
    assert np.mean(coverage.codes[top] == Sight.SEEN) == pytest.approx(0.5, abs=0.05)


@pytest.mark.parametrize("height_mm", [90.0, 210.0])
def test_what_is_too_near_or_too_far_is_out_of_reach(height_mm: float) -> None:
    coverage = over(box(), strips(height_mm, (0.0,)))
    middle = (coverage.normals[:, 2] > 0.5) & (np.abs(coverage.points[:, 0]) < 0.2 * height_mm)
    assert (coverage.codes[middle] == Sight.OUT_OF_RANGE).all()


def test_a_sphere_from_one_side_is_seen_up_to_the_limit_of_incidence() -> None:
    sphere = trimesh.creation.icosphere(subdivisions=5, radius=40.0)
    coverage = over(sphere, strips(170.0, (0.0, -25.0, 25.0)))
    top = coverage.points[:, 2]
    # Seen for certain where a beam straight down meets it at less than 65 deg; beams of the fan are up to 11 deg off.
    assert (coverage.codes[top > 40.0 * np.cos(np.radians(53.0))] == Sight.SEEN).all()
    low = (top > 1.0) & (top < 40.0 * np.cos(np.radians(78.0)))
    assert not (coverage.codes[low] == Sight.SEEN).any()
    assert (coverage.codes[low] == Sight.INCIDENCE).any()


def test_the_floor_of_a_deep_slot_is_occluded() -> None:
    walls = [trimesh.creation.box((100.0, 40.0, 40.0)).apply_translation((0.0, y, 20.0)) for y in (-28.0, 28.0)]
    coverage = over(box() + walls[0] + walls[1], strips(170.0, (-30.0, 0.0, 30.0)))
    x, y, z = coverage.points.T
    floor = (coverage.normals[:, 2] > 0.5) & (np.abs(z) < 1e-6) & (np.abs(y) < 4.0) & (np.abs(x) < 45.0)
    assert floor.sum() > 20
    assert (coverage.codes[floor] == Sight.OCCLUDED).all()
    tops = (coverage.normals[:, 2] > 0.5) & (z > 39.0)  # all of it is under the fans
    assert (coverage.codes[tops] == Sight.SEEN).all()


def test_what_another_part_hides_from_the_laser_is_occluded() -> None:
    roof = trimesh.creation.box((100.0, 100.0, 2.0)).apply_translation((0.0, 0.0, 30.0))
    coverage = over(box() + roof, strips(150.0, (-30.0, 30.0)))
    floor = (coverage.normals[:, 2] > 0.5) & (np.abs(coverage.points[:, 2]) < 1e-6)
    assert np.mean(coverage.codes[floor] == Sight.OCCLUDED) > 0.98


def test_each_reason_has_its_words() -> None:
    assert set(REASONS) == set(Sight) - {Sight.SEEN}
