"""The plot of a cloud's deviation, read back: unrolled parts, and positions in the picture."""

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from planner.arrays import FloatArray
from planner.scanning.deviation_plots import Panel, axis_of_revolution, smoothed, unrolled

CREATE = trimesh.creation
ROUND = {
    "cylinder": CREATE.cylinder(20.0, 100.0),
    "faceted cylinder": CREATE.cylinder(20.0, 100.0, sections=12),
    "sphere": CREATE.icosphere(3, 10.0),
    "cone": CREATE.cone(10.0, 30.0),
    "torus": CREATE.torus(20.0, 5.0),
    "pipe": CREATE.annulus(5.0, 10.0, 40.0),
}
ANGULAR = {
    "cube": CREATE.box((10.0, 10.0, 10.0)),
    "block": CREATE.box((10.0, 20.0, 30.0)),
    "block with a round boss": CREATE.box((60.0, 60.0, 20.0))
    + CREATE.cylinder(10.0, 30.0).apply_translation((10.0, 0.0, 25.0)),
    "two cylinders": CREATE.cylinder(10.0, 50.0) + CREATE.cylinder(10.0, 50.0).apply_translation((40.0, 0.0, 0.0)),
}
TILT = np.eye(4)
TILT[:3, :3], TILT[:3, 3] = Rotation.from_rotvec((0.3, -0.5, 0.8)).as_matrix(), (5.0, 1.0, 2.0)


@pytest.mark.parametrize("name", ROUND)
def test_the_axis_of_a_round_part_is_found_however_it_lies(name: str) -> None:
    assert axis_of_revolution(ROUND[name]) == pytest.approx((0.0, 0.0, 1.0))
    axis = axis_of_revolution(ROUND[name].copy().apply_transform(TILT))
    assert axis is not None
    if name != "sphere":
        assert abs(axis @ TILT[:3, 2]) == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("name", ANGULAR)
def test_no_other_part_is_unrolled(name: str) -> None:
    assert axis_of_revolution(ANGULAR[name]) is None
    assert axis_of_revolution(ANGULAR[name].copy().apply_transform(TILT)) is None


def at(panel: Panel, x: float, y: float) -> float:
    left, right, bottom, top = panel.extent
    rows, columns = panel.deviation_um.shape
    row, column = int((y - bottom) / (top - bottom) * rows), int((x - left) / (right - left) * columns)
    return float(panel.deviation_um[row, column])


def bump(points: FloatArray, place: tuple[float, float, float]) -> FloatArray:
    heights: FloatArray = 50.0 * np.exp(-0.5 * (np.linalg.norm(points - place, axis=1) / 6.0) ** 2)
    return heights


@pytest.mark.parametrize(
    ("place", "panel", "x", "y"),
    [
        ((20.0, 0.0, 30.0), 0, 1.0, 30.0),
        ((20.0, 0.0, 30.0), 0, 359.0, 30.0),  # both edges of the unrolled wall are the same place
        ((0.0, 20.0, -10.0), 0, 90.0, -10.0),
        ((-20.0, 0.0, 0.0), 0, 180.0, 0.0),
        ((8.0, -5.0, 50.0), 1, 8.0, -5.0),
        ((8.0, -5.0, -50.0), 2, 8.0, 5.0),  # from below y points downwards
    ],
)
def test_a_bump_on_a_cylinder_is_drawn_where_it_is(
    place: tuple[float, float, float], panel: int, x: float, y: float
) -> None:
    mesh = ROUND["cylinder"]
    points, _ = trimesh.sample.sample_surface(mesh, 40_000, seed=2)
    panels = unrolled(mesh, np.array((0.0, 0.0, 1.0)), np.asarray(points), bump(np.asarray(points), place))
    assert [each.title for each in panels] == ["wall, unrolled", "end, from above", "end, from below"]
    assert at(panels[panel], x, y) == pytest.approx(48.0, abs=5.0)
    assert np.nanmean(panels[panel].deviation_um) < 12.0


def test_an_average_is_weighted_by_points_and_ends_where_none_are_near() -> None:
    cells = np.array([20 * 40 + 20] * 3 + [20 * 40 + 21])
    averaged = smoothed(cells, np.array([4.0, 4.0, 4.0, 8.0]), (40, 40))
    assert averaged[20, 20] == pytest.approx(5.0, abs=0.1)
    assert np.isnan(averaged[20, 32])
    assert np.isfinite(averaged[20, 27])
