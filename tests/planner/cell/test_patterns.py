"""The properties of every pattern, checked on the workpiece's mesh instead of the pattern's own formulas."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from planner.arrays import FloatArray
from planner.cell.cell import Probe
from planner.cell.patterns import PATTERNS, StripLayout
from planner.cell.scan_path import at_scan_speed
from planner.cell.workpiece import CLASSES, Block, Cylinder, Mould, Sphere, Workpiece
from planner.defaults import PART_CLASSES, PATTERN_NAMES

PROBE = Probe()
LAYOUT = StripLayout()
WORKPIECES: dict[str, Workpiece] = {
    "block": Block(300.0, 200.0, 50.0, middle_mm=(5.0, -10.0, 20.0)),
    "sphere": Sphere(160.0, middle_mm=(5.0, -10.0, 20.0)),
    "cylinder": Cylinder(140.0, 180.0, middle_mm=(5.0, -10.0, 20.0)),
    "mould": Mould(300.0, 200.0, 80.0, 240.0, 140.0, 50.0, middle_mm=(5.0, -10.0, 20.0)),
}
ALL = [(kind, pattern) for kind, patterns in PATTERNS.items() for pattern in patterns]


def test_the_command_line_and_the_docs_know_every_pattern() -> None:
    assert {*PATTERN_NAMES} == {pattern for _, pattern in ALL}
    page = (Path(__file__).parents[3] / "docs" / "own-part.md").read_text(encoding="utf-8")
    assert not [pattern for pattern in PATTERN_NAMES if f"`{pattern}`" not in page]


def test_the_command_line_knows_every_class() -> None:
    assert {*PART_CLASSES} == {*CLASSES} == {*PATTERNS}


def waypoints_of(kind: str, pattern: str, layout: StripLayout = LAYOUT) -> FloatArray:
    return PATTERNS[kind][pattern](WORKPIECES[kind], PROBE, layout)


def closest_point(mesh: trimesh.Trimesh, points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    return tuple(trimesh.proximity.closest_point(mesh, points))  # type: ignore[no-untyped-call]  # trimesh has none


def covered_points(waypoints: FloatArray) -> FloatArray:
    """Return points along the laser line at each waypoint, at the stand-off."""
    along = np.linspace(-0.5, 0.5, 13) * PROBE.line_width_mm
    line = np.column_stack((along, np.zeros(13), np.full(13, PROBE.stand_off_mm), np.ones(13)))
    return np.asarray((waypoints @ line.T)[:, :3].transpose(0, 2, 1).reshape(-1, 3))


@pytest.mark.parametrize(("kind", "pattern"), ALL)
def test_the_beam_meets_the_surface_at_the_stand_off(kind: str, pattern: str) -> None:
    waypoints = waypoints_of(kind, pattern)
    beam_ends = waypoints[:, :3, 3] + PROBE.stand_off_mm * waypoints[:, :3, 2]
    _, distances, _ = closest_point(WORKPIECES[kind].mesh(), beam_ends)
    assert distances.max() < 0.3  # distance of the sphere's mesh from the sphere


@pytest.mark.parametrize(("kind", "pattern"), [pair for pair in ALL if pair[0] not in ("block", "mould")])
def test_the_beam_comes_in_along_the_normal(kind: str, pattern: str) -> None:
    waypoints = waypoints_of(kind, pattern)
    mesh = WORKPIECES[kind].mesh()
    beam_ends = waypoints[:, :3, 3] + PROBE.stand_off_mm * waypoints[:, :3, 2]
    _, _, triangles = closest_point(mesh, beam_ends)
    along_normal = -np.sum(mesh.face_normals[triangles] * waypoints[:, :3, 2], axis=1)
    assert np.degrees(np.arccos(np.clip(along_normal, -1.0, 1.0))).max() < 3.0  # the facets of the mesh


@pytest.mark.parametrize(("kind", "pattern"), ALL)
def test_a_pattern_has_no_jumps(kind: str, pattern: str) -> None:
    path = at_scan_speed(waypoints_of(kind, pattern), 30.0, 0.5, PROBE.stand_off_mm, PROBE.line_width_mm)
    points = covered_points(path.T_WS).reshape(path.count, 13, 3)
    assert np.linalg.norm(np.diff(points, axis=0), axis=2).max() < 1.05 * 15.0


@pytest.mark.parametrize("pattern", ["meridians", "spiral"])
def test_the_line_passes_over_the_whole_sphere_between_the_polar_angles(pattern: str) -> None:
    sphere = WORKPIECES["sphere"]
    center = np.add(sphere.middle_mm, (0.0, 0.0, 80.0))
    points = sphere.mesh().vertices
    polar = np.degrees(np.arccos((points[:, 2] - center[2]) / 80.0))
    wanted = points[(polar > LAYOUT.top_polar_deg + 5.0) & (polar < LAYOUT.lowest_polar_deg - 5.0)]
    # The line is straight, so its ends stand off the sphere: compare directions from the center.
    covered = covered_points(waypoints_of("sphere", pattern)) - center
    assert _greatest_gap(_unit(covered) * 80.0, wanted - center) < 6.0


@pytest.mark.parametrize("pattern", ["rings", "helix"])
def test_the_line_passes_over_the_whole_cylinder_above_its_bottom_margin(pattern: str) -> None:
    azimuth, height = np.meshgrid(np.linspace(0.0, 2.0 * np.pi, 60), np.linspace(12.0, 178.0, 40))
    wanted = np.column_stack(
        (70.0 * np.cos(azimuth.ravel()) + 5.0, 70.0 * np.sin(azimuth.ravel()) - 10.0, height.ravel() + 20.0)
    )
    assert _greatest_gap(covered_points(waypoints_of("cylinder", pattern)), wanted) < 6.0


@pytest.mark.parametrize("pattern", ["raster", "crossed", "tilted"])
def test_the_line_passes_over_the_floor_of_the_mould_up_to_the_wall_margin(pattern: str) -> None:
    x, y = np.meshgrid(np.linspace(-105.0, 105.0, 40), np.linspace(-69.0, 69.0, 24))
    wanted = np.column_stack((x.ravel() + 5.0, y.ravel() - 10.0, np.full(x.size, 50.0)))
    covered = covered_points(waypoints_of("mould", pattern))
    # A tilted line leaves the floor's plane towards its ends: follow it along the beam down to the floor.
    assert _greatest_gap(covered[:, :2], wanted[:, :2]) < 6.0


def test_a_raster_over_a_block_goes_from_edge_to_edge() -> None:
    waypoints = waypoints_of("block", "raster")
    covered = covered_points(waypoints)
    np.testing.assert_allclose([covered[:, 0].min(), covered[:, 0].max()], [-145.0, 155.0])
    np.testing.assert_allclose([covered[:, 1].min(), covered[:, 1].max()], [-110.0, 90.0])
    np.testing.assert_allclose(covered[:, 2], 70.0)


def _unit(vectors: FloatArray) -> FloatArray:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))


def _greatest_gap(covered: FloatArray, wanted: FloatArray) -> float:
    """Return the distance of the farthest required point from the nearest covered one."""
    return max(float(np.linalg.norm(covered - point, axis=1).min()) for point in wanted)


@pytest.mark.parametrize("overlap", [0.0, 0.2, 0.5])
def test_strips_lie_a_line_width_less_the_overlap_apart_at_most(overlap: float) -> None:
    layout = StripLayout(overlap=overlap)
    middles = layout.strip_centers(300.0, 60.0)
    assert np.diff(middles).max() <= 60.0 * (1.0 - overlap) + 1e-9
    assert middles[0] == pytest.approx(-120.0)
    assert middles[-1] == pytest.approx(120.0)
    one_fewer = (middles[-1] - middles[0]) / (len(middles) - 2)
    assert one_fewer > 60.0 * (1.0 - overlap)


def test_a_span_narrower_than_the_line_takes_one_strip_in_its_middle() -> None:
    np.testing.assert_array_equal(LAYOUT.strip_centers(40.0, 60.0), [0.0])


def test_a_crossed_raster_turns_the_line_by_a_right_angle() -> None:
    waypoints = waypoints_of("mould", "crossed")
    assert abs(waypoints[0, :3, 0] @ waypoints[-1, :3, 0]) < 1e-12


def test_a_tilted_raster_sees_the_walls_on_both_sides() -> None:
    across = waypoints_of("mould", "tilted")[:, 1, 2]
    np.testing.assert_allclose([across.min(), across.max()], [-np.sin(np.radians(25.0)), np.sin(np.radians(25.0))])
