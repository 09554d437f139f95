import math
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from planner.arrays import FloatArray
from planner.cell.cell import Probe, placement
from planner.geometry.ray_casting import RayCaster
from planner.scanning.probe import LaserProbe, Profiles, Sight, measure, sight

QUIET = replace(LaserProbe(), noise_mm=0.0)


def from_above(height_mm: float, tilt_deg: float = 0.0) -> FloatArray:
    """Return one pose that looks down on the origin from a height, tilted about its line, which is along x."""
    return placement(0.0, 0.0, 0.0, 90.0, tilt_deg, 0.0) @ placement(0.0, 0.0, height_mm, 0.0, 180.0, 90.0)


def taken(mesh: trimesh.Trimesh, T_WS: FloatArray, probe: LaserProbe = QUIET) -> Profiles:
    return measure(RayCaster(mesh), probe, T_WS[np.newaxis])


def plate(thickness_mm: float = 10.0) -> trimesh.Trimesh:
    """Return a plate whose top is z = 0."""
    mesh: trimesh.Trimesh = trimesh.creation.box((400.0, 400.0, thickness_mm))
    mesh.apply_translation((0.0, 0.0, -0.5 * thickness_mm))
    return mesh


def test_a_plate_at_the_stand_off_is_a_straight_line_of_full_width() -> None:
    seen = taken(plate(), from_above(150.0))
    assert len(seen.points_S) == 640
    assert seen.points_S[:, 2] == pytest.approx(150.0, abs=1e-9)
    assert seen.points_S[:, 1] == pytest.approx(0.0, abs=1e-12)
    assert (seen.points_S[0, 0], seen.points_S[-1, 0]) == pytest.approx((-30.0, 30.0))
    assert np.diff(seen.points_S[:, 0]) == pytest.approx(60.0 / 639)
    assert seen.true_W[:, 2] == pytest.approx(0.0, abs=1e-9)
    assert (seen.normals_W == (0.0, 0.0, 1.0)).all()


def test_a_cylinder_along_the_line_is_straight_and_across_it_a_circle() -> None:
    cylinder = trimesh.creation.cylinder(radius=40.0, height=300.0, sections=4000)
    upright = taken(cylinder, placement(190.0, 0.0, 0.0, 180.0, 90.0, 0.0))
    assert upright.points_S[:, 2] == pytest.approx(150.0, abs=1e-4)
    across = taken(cylinder, placement(190.0, 0.0, 0.0, 180.0, 90.0, 90.0))
    assert np.hypot(across.points_S[:, 0], across.points_S[:, 2] - 190.0) == pytest.approx(40.0, abs=1e-4)


def test_the_profile_of_a_sphere_is_the_circle_in_the_plane_of_the_laser() -> None:
    sphere = trimesh.creation.icosphere(subdivisions=6, radius=50.0)
    seen = taken(sphere, placement(0.0, 0.0, 200.0, 0.0, 180.0, 0.0) @ placement(0.0, 20.0, 0.0, 0.0, 0.0, 0.0))
    circle_mm = math.sqrt(50.0**2 - 20.0**2)
    assert np.hypot(seen.points_S[:, 0], seen.points_S[:, 2] - 200.0) == pytest.approx(
        circle_mm, abs=5e-3
    )  # the facets are flat
    assert np.linalg.norm(seen.true_W, axis=1) == pytest.approx(50.0, abs=5e-3)


@pytest.mark.parametrize(
    ("height_mm", "is_measured"), [(99.9, False), (100.1, True), (150.0, True), (199.9, True), (200.1, False)]
)
def test_only_what_is_within_the_range_is_measured(height_mm: float, is_measured: bool) -> None:
    assert (len(taken(plate(), from_above(height_mm)).points_S) > 0) == is_measured


@pytest.mark.parametrize(("tilt_deg", "is_measured"), [(0.0, True), (60.0, True), (64.9, True), (65.1, False)])
def test_incidence_ends_where_the_limit_is(tilt_deg: float, is_measured: bool) -> None:
    middle = replace(QUIET, half_width=1e-6)
    assert (len(taken(plate(), from_above(150.0, tilt_deg), middle).points_S) > 0) == is_measured


def test_on_a_sphere_incidence_ends_at_the_limits_circle() -> None:
    sphere = trimesh.creation.icosphere(subdivisions=6, radius=20.0)
    seen = taken(sphere, placement(0.0, 0.0, 170.0, 0.0, 180.0, 0.0))
    # The triangle of center, laser and surface point: the incidence is the angle outside it at the point.
    off_axis = np.arctan2(np.abs(seen.points_S[:, 0]), seen.points_S[:, 2])
    incidence_deg = np.degrees(np.arcsin(170.0 * np.sin(off_axis) / 20.0))
    assert incidence_deg.max() == pytest.approx(65.0, abs=1.0)  # a facet is 2 deg wide, a point 0.3


def slot(half_width_mm: float, depth_mm: float) -> trimesh.Trimesh:
    """Return a slot along x with its floor at z = 0."""
    wall = trimesh.creation.box((400.0, 100.0, depth_mm))
    sides = [wall.copy().apply_translation((0, y * (half_width_mm + 50.0), 0.5 * depth_mm)) for y in (-1, 1)]
    mesh: trimesh.Trimesh = plate() + sides[0] + sides[1]
    return mesh


@pytest.mark.parametrize(("half_width_mm", "is_measured"), [(11.9, False), (12.1, True)])
def test_the_floor_of_a_slot_is_seen_while_a_camera_looks_over_its_edge(
    half_width_mm: float, is_measured: bool
) -> None:
    # The way from a camera 60 mm beside the laser to the line 150 mm below is 12 mm off 30 mm above the floor.
    assert (len(taken(slot(half_width_mm, 30.0), from_above(150.0)).points_S) > 0) == is_measured


def test_one_camera_is_enough() -> None:
    one_wall = trimesh.creation.box((400.0, 100.0, 60.0)).apply_translation((0.0, 55.0, 30.0))
    both: trimesh.Trimesh = plate() + one_wall
    assert len(taken(both, from_above(150.0)).points_S) == 640
    for camera, count in ((0, 640), (1, 640)):
        lone = replace(QUIET, cameras_mm=(QUIET.cameras_mm[camera],))
        seen = [len(taken(mesh, from_above(150.0), lone).points_S) for mesh in (plate(), both)]
        assert seen[0] == count
    lone_counts = {
        len(taken(both, from_above(150.0), replace(QUIET, cameras_mm=(camera,))).points_S)
        for camera in QUIET.cameras_mm
    }
    assert lone_counts == {0, 640}


def test_the_condition_that_failed_is_told() -> None:
    caster = RayCaster(slot(5.0, 30.0))
    T = np.stack([from_above(150.0), from_above(250.0), from_above(150.0, 70.0)])
    points, normals = np.zeros((3, 3)), np.tile((0.0, 0.0, 1.0), (3, 1))
    codes = sight(caster, QUIET, T, np.arange(3), points, normals, np.array([150.0, 250.0, 150.0]))
    assert codes.tolist() == [Sight.OCCLUDED, Sight.OUT_OF_RANGE, Sight.INCIDENCE]


def test_noise_is_along_the_ray_and_of_the_probes_sigma() -> None:
    probe = LaserProbe()
    caster, T_WS = RayCaster(plate()), np.tile(from_above(150.0), (40, 1, 1))
    noisy, quiet = measure(caster, probe, T_WS), measure(caster, QUIET, T_WS)
    error = noisy.points_S - quiet.points_S
    along = np.einsum("ij,ij->i", error, noisy.rays_S)
    assert np.linalg.norm(error - along[:, np.newaxis] * noisy.rays_S, axis=1).max() < 1e-9
    assert along.std() == pytest.approx(0.025, rel=0.02)
    assert abs(along.mean()) < 5.0 * 0.025 / math.sqrt(len(along))


def test_a_profiles_noise_depends_on_seed_and_number_only() -> None:
    caster, T_WS = RayCaster(plate()), np.tile(from_above(150.0), (3, 1, 1))
    together = measure(caster, LaserProbe(), T_WS, np.array([4, 5, 6]), seed=1)
    alone = measure(caster, LaserProbe(), T_WS[:1], np.array([5]), seed=1)
    assert (together.points_S[together.profiles == 1] == alone.points_S).all()
    other = measure(caster, LaserProbe(), T_WS[:1], np.array([5]), seed=2)
    assert (other.points_S != alone.points_S).any()


def test_the_cells_probe_gives_range_and_width() -> None:
    probe = LaserProbe.of(Probe(stand_off_mm=100.0, nearest_mm=80.0, farthest_mm=130.0, line_width_mm=50.0))
    assert (probe.nearest_mm, probe.farthest_mm, probe.half_width) == (80.0, 130.0, 0.25)
    assert math.degrees(math.atan(LaserProbe.of(Probe()).half_width)) == pytest.approx(11.3, abs=0.02)


def test_no_poses_give_no_points() -> None:
    assert len(measure(RayCaster(plate()), LaserProbe(), np.zeros((0, 4, 4))).points_S) == 0
