"""Patterns over meshes keep the stand-off from the surface, and stay above steps in it."""

import numpy as np
import pytest
import trimesh

from planner.cell.cell import Probe, placement
from planner.cell.mesh_path import CLASS_OF_PATTERN, following, mesh_waypoints
from planner.cell.patterns import PATTERNS, StripLayout
from planner.cell.workpiece import Cylinder, Mould, Sphere
from planner.errors import PathError
from planner.geometry.ray_casting import RayCaster
from tests.planner.own_parts import OWN_PARTS
from tests.planner.parts import joined

PROBE, LAYOUT = Probe(), StripLayout()


def test_the_patterns_of_a_mesh_are_those_of_all_classes() -> None:
    assert set(CLASS_OF_PATTERN) == {pattern for patterns in PATTERNS.values() for pattern in patterns}


@pytest.mark.parametrize(
    ("kind", "pattern", "ideal"),
    [
        ("sphere", "spiral", Sphere(120.0)),
        ("cylinder", "helix", Cylinder(100.0, 140.0)),
        ("mould", "tilted", Mould(300.0, 200.0, 80.0, 240.0, 140.0, 50.0)),
    ],
)
def test_a_mesh_of_the_ideal_shape_gets_the_ideal_path(
    kind: str, pattern: str, ideal: Sphere | Cylinder | Mould
) -> None:
    waypoints = mesh_waypoints(ideal.mesh(), kind, pattern, np.eye(4), PROBE, LAYOUT)
    np.testing.assert_allclose(waypoints, PATTERNS[kind][pattern](ideal, PROBE, LAYOUT), atol=0.2)


@pytest.mark.parametrize("name", ["cone", "gear", "bracket", "torus", "tube", "plate"])
@pytest.mark.parametrize("pattern", CLASS_OF_PATTERN)
def test_the_surface_is_at_the_stand_off_or_behind_it_and_within_the_range_nearby(name: str, pattern: str) -> None:
    mesh = OWN_PARTS[name].mesh
    waypoints = mesh_waypoints(mesh, CLASS_OF_PATTERN[pattern], pattern, np.eye(4), PROBE, LAYOUT)
    hits_mm = RayCaster(mesh).first_hits(waypoints[:, :3, 3], waypoints[:, :3, 2]).distances_mm
    met = hits_mm[np.isfinite(hits_mm)]
    assert met.min() >= PROBE.stand_off_mm - 1.0
    assert np.mean(met <= PROBE.farthest_mm) > 0.4  # beside the wall of the bracket, its base is far below


def test_a_probe_stays_above_a_step_as_long_as_it_is_near() -> None:
    # A block of 20 mm with one of 60 mm beside it, seen from above along x.
    low, high = trimesh.creation.box((100.0, 80.0, 20.0)), trimesh.creation.box((100.0, 80.0, 60.0))
    low.apply_translation((-50.0, 0.0, 10.0))
    high.apply_translation((50.0, 0.0, 30.0))
    x = np.arange(-90.0, 91.0, 2.0)
    waypoints = np.array([placement(each, 0.0, 300.0, 0.0, 180.0, 0.0) for each in x])
    heights = following(waypoints, joined(low, high), 150.0)[:, 2, 3]
    np.testing.assert_allclose(heights[x < -20.5], 170.0, atol=1e-6)
    np.testing.assert_allclose(heights[x > -19.5], 210.0, atol=1e-6)


def test_between_two_bodies_the_probe_goes_straight_from_one_to_the_other() -> None:
    left, right = trimesh.creation.box((20.0, 20.0, 20.0)), trimesh.creation.box((20.0, 20.0, 40.0))
    left.apply_translation((-60.0, 0.0, 10.0))
    right.apply_translation((60.0, 0.0, 20.0))
    x = np.arange(-60.0, 61.0, 2.0)
    waypoints = np.array([placement(each, 0.0, 300.0, 0.0, 180.0, 0.0) for each in x])
    heights = following(waypoints, joined(left, right), 150.0)[:, 2, 3]
    between = np.abs(x) < 30.0
    assert np.ptp(np.diff(heights[between])) < 1e-9
    assert heights.min() == pytest.approx(170.0)
    assert heights.max() == pytest.approx(190.0)


def test_beams_that_all_miss_are_refused() -> None:
    mesh = trimesh.creation.box((20.0, 20.0, 20.0))
    with pytest.raises(PathError, match="no beam of the pattern meets the part"):
        following(np.array([placement(500.0, 0.0, 300.0, 0.0, 180.0, 0.0)] * 2), mesh, 150.0)


@pytest.mark.parametrize("turn", [(0.0, 90.0, 0.0), (0.0, -90.0, 0.0), (0.0, 90.0, 90.0), (0.0, 180.0, 0.0)])
def test_a_pattern_is_laid_about_the_tables_vertical(turn: tuple[float, float, float]) -> None:
    T_TW = placement(0.0, 0.0, 0.0, *turn)
    mesh = trimesh.creation.cylinder(radius=50.0, height=140.0, sections=96)
    mesh.apply_transform(np.linalg.inv(T_TW))
    waypoints = mesh_waypoints(mesh, "cylinder", "rings", T_TW, PROBE, LAYOUT)
    on_table = T_TW @ waypoints
    np.testing.assert_allclose(on_table[:, 2, 2], 0.0, atol=1e-9)  # beams are level
    np.testing.assert_allclose(np.linalg.norm(on_table[:, :2, 3], axis=1), 200.0, atol=0.2)
