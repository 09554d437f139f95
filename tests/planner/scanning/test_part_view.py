"""The view of a part, read back pixel by pixel."""

import numpy as np
import pytest
import trimesh

from planner.geometry.ray_casting import RayCaster
from planner.scanning.part_view import View, painted

# A block without symmetry, with a bump on its far right upper corner.
BLOCK: trimesh.Trimesh = trimesh.creation.box((100.0, 60.0, 40.0)).apply_translation(
    (0.0, 0.0, 20.0)
) + trimesh.creation.box((20.0, 20.0, 20.0)).apply_translation((40.0, 20.0, 50.0))
MARK = np.array([1.0, 0.0, 0.0])


def marked(azimuth_deg: float, elevation_deg: float, point: tuple[float, float, float]) -> "tuple[int, int] | None":
    """Return row and column of the middle of a red mark at a point of the surface; None if it is hidden."""
    view = View.of(BLOCK, azimuth_deg, elevation_deg)
    image = painted(view, RayCaster(BLOCK), np.array([point]), MARK[np.newaxis], 5)
    red = np.argwhere((image[:, :, 0] > 0.3) & (image[:, :, 1] < 0.05))
    return tuple(np.round(red.mean(axis=0)).astype(int)) if len(red) else None


def test_seen_from_the_front_x_is_to_the_right_and_z_is_up() -> None:
    """From -y, a little above: the view of a person in front of the part."""
    left, right, low, high = (
        marked(-90.0, 10.0, point)
        for point in ((-40.0, -30.0, 20.0), (40.0, -30.0, 20.0), (0.0, -30.0, 5.0), (0.0, -30.0, 35.0))
    )
    assert left is not None
    assert right is not None
    assert low is not None
    assert high is not None
    assert right[1] - left[1] > 300
    assert left[0] == pytest.approx(right[0], abs=1)
    assert low[0] - high[0] > 100  # rows count downwards
    assert low[1] == pytest.approx(high[1], abs=1)


def test_seen_from_the_right_y_is_to_the_right() -> None:
    near, far = (marked(0.0, 10.0, (50.0, y, 20.0)) for y in (-25.0, 25.0))
    assert near is not None
    assert far is not None
    assert far[1] - near[1] > 100


def test_what_is_behind_the_part_is_notpainted() -> None:
    assert marked(-90.0, 10.0, (0.0, 30.0, 20.0)) is None
    assert marked(90.0, 10.0, (0.0, 30.0, 20.0)) is not None


def test_a_mark_lies_on_the_pixel_where_the_bare_part_has_the_same_depth() -> None:
    caster = RayCaster(BLOCK)
    points, _ = trimesh.sample.sample_surface(BLOCK, 300, seed=1)
    for azimuth_deg, elevation_deg in ((-60.0, 35.0), (120.0, 35.0), (200.0, 60.0)):
        view = View.of(BLOCK, azimuth_deg, elevation_deg)
        rows, columns, depths_mm = view.pixels(np.asarray(points))
        surface_mm = view.surface(caster)[1][rows, columns]
        off_mm = depths_mm - surface_mm
        seen = np.abs(off_mm) < 1.5 * view.pixel_mm + 0.5
        # Points are on the visible surface or behind it, never in front; about half of them are visible.
        assert np.nanmin(off_mm) > -6.0 * view.pixel_mm
        assert 0.25 < seen.mean() < 0.75
