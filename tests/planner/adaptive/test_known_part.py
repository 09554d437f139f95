import numpy as np
import pytest
import trimesh

from planner.adaptive import known_part
from planner.adaptive.policy import PolicyError, Returned
from planner.adaptive.visibility import Places, sees
from planner.arrays import FloatArray
from planner.cell.cell import placement
from planner.cell.scan import load_scan
from planner.cell.scan_path import looking_at
from planner.geometry.ray_casting import RayCaster
from planner.scanning.probe import LaserProbe
from tests.planner.adaptive.adaptive_parts import cup, policy_of, scan_of, without_points
from tests.planner.adaptive.test_visibility import profiles


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Few candidates: enough for shapes this simple."""
    monkeypatch.setattr(known_part, "_ROUNDS", ((30, 4),))


def scanned_whole(policy: known_part.KnownPart) -> list[FloatArray]:
    """Scan strips as the session does, with a probe that measures all along them; return the strips."""
    strips: list[FloatArray] = []
    while batch := policy.next_strips():
        for strip in batch:
            policy.take(strip, without_points(profiles(strip.T_WS)))
            strips.append(strip.T_WS)
    return strips


def test_the_inside_wall_of_a_cup_is_found_and_strips_tilt_into_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(known_part, "_ROUNDS", ((60, 5), (30, 12)))
    mesh = cup()
    policy = policy_of(scan_of(mesh))
    strips = scanned_whole(policy)
    points, normals = policy.coverage.points, policy.coverage.normals
    radius, height = np.hypot(points[:, 0], points[:, 1]), points[:, 2]
    wall = (radius < 45.5) & (np.abs(normals[:, 2]) < 0.1) & (height > 30.0)
    assert wall.sum() > 200
    assert policy.visible[wall].mean() > 0.95
    assert policy.seen[wall & policy.visible].mean() > 0.97
    assert policy.seen.sum() >= 0.99 * policy.visible.sum()
    into = [T_WS for T_WS in strips if seen_by(mesh, T_WS, points[wall], normals[wall]) > 10]
    tilts_deg = [float(np.degrees(np.arccos(-T_WS[0, 2, 2]))) for T_WS in into]
    assert len(into) >= 3
    assert all(15.0 < tilt < 80.0 for tilt in tilts_deg)
    # The bottom faces the table: no strip sees it, and none is laid for it.
    assert not policy.visible[normals[:, 2] < -0.9].any()


def seen_by(mesh: trimesh.Trimesh, T_WS: FloatArray, points: FloatArray, normals: FloatArray) -> int:
    places = Places(points, normals)
    return int(sees(RayCaster(mesh), LaserProbe(), T_WS[np.newaxis], np.array([len(T_WS) - 1]), places).sum())


def test_no_strip_is_added_to_a_sphere_that_was_seen() -> None:
    scan = load_scan("sphere")
    policy = policy_of(scan)
    middle, radius = np.array([0.0, 0.0, 80.0]), 80.0
    meridians = np.meshgrid(np.radians(np.arange(0.0, 180.5, 0.6)), np.radians(np.arange(0.0, 360.0, 30.0)))
    polar, azimuth = (each.ravel() for each in meridians)
    ways = np.column_stack((np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)))
    lines = np.column_stack((-np.sin(azimuth), np.cos(azimuth), np.zeros_like(azimuth)))
    policy.take(None, without_points(looking_at(middle + radius * ways, ways, lines, 150.0)))
    assert policy.seen.mean() > 0.99
    assert list(policy.next_strips()) == []
    assert policy.state().endswith("of what can be seen")


def test_what_can_be_seen_is_what_was_seen_and_what_candidates_see() -> None:
    policy = policy_of(scan_of(cup()), share=0.5)
    assert not policy.visible.any()
    first = policy.next_strips()
    before = policy.visible.copy()
    assert 0.5 < before.mean() < 0.95
    policy.refuse(first[0], "out of reach")
    assert first[0].name not in [strip.name for strip in policy.next_strips()]
    refused = 0
    while (strips := policy.next_strips()) and refused < 400:
        for strip in strips:
            policy.refuse(strip, "out of reach")
        refused += len(strips)
    np.testing.assert_array_equal(policy.visible, before)  # refusing does not raise the share of what can be seen


def test_no_more_strips_are_wanted_than_may_be_scanned() -> None:
    policy = policy_of(scan_of(cup()), most=3)
    strips = policy.next_strips()
    assert len(strips) == 3
    for strip in strips:
        policy.take(strip, without_points(profiles(strip.T_WS)))
    assert list(policy.next_strips()) == []


def test_a_part_of_which_nothing_can_be_reached_is_refused() -> None:
    far = trimesh.creation.box((20.0, 20.0, 20.0)).apply_translation((0.0, 0.0, 1500.0))
    with pytest.raises(PolicyError, match="nothing of the part can be reached; move the part"):
        policy_of(scan_of(far)).next_strips()


def test_a_cloud_that_does_not_fit_the_mesh_is_refused() -> None:
    scan = scan_of(cup())
    policy = policy_of(scan)
    T_WS = placement(0.0, 0.0, 225.0, 0.0, 180.0, 0.0)[np.newaxis]
    on_rim = np.column_stack((np.full(50, 47.0), np.linspace(-1.0, 1.0, 50), np.full(50, 75.0)))
    at = np.zeros(50, dtype=np.int64)
    policy.take(None, Returned(T_WS, at, on_rim + np.array([0.0, 0.0, 0.02])))
    with pytest.raises(PolicyError, match="the cloud does not fit the mesh: 100% of the points of the predefined path"):
        policy.take(None, Returned(T_WS, at, on_rim + np.array([0.0, 0.0, 3.0])))


def test_a_strip_keeps_its_speed() -> None:
    strip = policy_of(scan_of(cup()), share=0.3).next_strips()[0]
    lengths_mm = np.linalg.norm(np.diff(strip.T_WS[:, :3, 3], axis=0), axis=1)
    assert lengths_mm.max() / strip.path.step_s == pytest.approx(20.0)
