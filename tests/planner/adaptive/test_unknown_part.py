"""The policy without a mesh, with a probe in the hand: what it asks to see next, and that it has no mesh to ask."""

import gc
import inspect
import types
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import trimesh

from planner.adaptive.policy import Policy, PolicyError
from planner.adaptive.session import run_session
from planner.adaptive.surroundings import Surroundings
from planner.adaptive.unknown_part import UnknownPart, survey
from planner.cell.scan import Scan, load_scan
from planner.cell.workpiece import Cylinder
from planner.scanning.probe import LaserProbe, Sight
from tests.planner.adaptive.hand_held_probe import HandHeldProbe

BOUNDS = Cylinder(100.0, 70.0)
CUP_WALL = ((0.0, 0.0), (40.0, 0.0), (40.0, 60.0), (28.0, 60.0), (28.0, 20.0), (0.0, 20.0))
"""Radius and height in mm along the profile of a cup."""


@cache
def scan() -> Scan:
    return load_scan("sphere")


@cache
def optics() -> LaserProbe:
    """Return a probe with few points, to save time."""
    return replace(LaserProbe.of(scan().cell.probe), points_per_line=200)


def cup() -> trimesh.Trimesh:
    return trimesh.creation.revolve(np.array(CUP_WALL), sections=64)


def ball() -> trimesh.Trimesh:
    mesh: trimesh.Trimesh = trimesh.creation.icosphere(subdivisions=4, radius=30.0)
    mesh.apply_translation((0.0, 0.0, 35.0))
    return mesh


def surveyed(mesh: trimesh.Trimesh) -> tuple[UnknownPart, HandHeldProbe]:
    """Return the policy and the probe after the survey."""
    surroundings = Surroundings.of(scan())
    policy, held = UnknownPart(surroundings, optics(), BOUNDS, 30.0), HandHeldProbe(mesh, optics())
    policy.take(None, held.sweep(survey(scan(), BOUNDS, 25.0).path.T_WS))
    return policy, held


def test_it_looks_into_a_cup_from_above() -> None:
    policy, held = surveyed(cup())
    radius, height = np.hypot(*held.coverage.points[:, :2].T), held.coverage.points[:, 2]
    inside = (radius < 28.5) & (height > 19.9)
    before = (held.coverage.codes[inside] == Sight.SEEN).mean()
    session = run_session(policy, held, 10)
    after = (held.coverage.codes[inside] == Sight.SEEN).mean()
    assert session.failure is None
    assert before < 0.3
    assert after > 0.8
    into = [strip.T_WS[:, 2, 2].mean() < -0.4 for strip in held.strips]
    assert sum(into) >= 2


def test_a_ball_is_finished_with_a_few_strips() -> None:
    policy, held = surveyed(ball())
    run_session(policy, held, 12)
    high = held.coverage.points[:, 2] > 20.0
    assert (held.coverage.codes[high] == Sight.SEEN).mean() > 0.995
    assert policy.next_strips() == ()


def test_no_strip_is_asked_for_twice() -> None:
    policy, held = surveyed(cup())
    for _ in range(3):
        for strip in policy.next_strips():
            policy.refuse(strip, "a test")
            held.strips.append(strip)
    middles = np.array([strip.T_WS.mean(axis=0) for strip in held.strips]).reshape(-1, 16)
    assert len(np.unique(middles.round(6), axis=0)) == len(middles)


@pytest.mark.parametrize(
    ("bounds", "words"),
    [
        (Cylinder(76.0, 70.0), r"2\.\d mm beside the bounding cylinder of 76 x 70 mm"),
        (Cylinder(100.0, 50.0), r"10\.\d mm above the bounding cylinder of 100 x 50 mm"),
    ],
)
def test_surface_beyond_the_cylinder_ends_it(bounds: Cylinder, words: str) -> None:
    narrow = UnknownPart(Surroundings.of(scan()), optics(), bounds, 30.0)
    seen = HandHeldProbe(cup(), optics()).sweep(survey(scan(), BOUNDS, 25.0).path.T_WS)
    with pytest.raises(PolicyError, match=words):
        narrow.take(None, seen)


def test_surface_below_the_cylinder_ends_it() -> None:
    policy, held = surveyed(cup())
    seen = held.sweep(survey(scan(), BOUNDS, 25.0).path.T_WS)
    with pytest.raises(PolicyError, match="mm below the bounding cylinder"):
        policy.take(None, seen._replace(points_W=seen.points_W - np.array((0.0, 0.0, 12.0))))


def test_where_nothing_was_seen_it_looks_into_the_cylinder() -> None:
    policy = UnknownPart(Surroundings.of(scan()), optics(), BOUNDS, 30.0)
    strips = policy.next_strips()
    assert strips
    middles = [strip.T_WS[:, :3, 3] + 100.0 * strip.T_WS[:, :3, 2] for strip in strips]
    assert all(np.hypot(*middle.mean(axis=0)[:2]) < 100.0 for middle in middles)


def test_the_points_beyond_a_cylinder_that_is_too_small_are_kept() -> None:
    policy, held = surveyed(ball())
    returned = held.sweep(survey(scan(), BOUNDS, 25.0).path.T_WS)
    beyond = returned._replace(points_W=returned.points_W + np.array((60.0, 0.0, 0.0)))
    session = run_session(policy, held, 1, scan_path=lambda: beyond)
    assert session.contradicts
    assert "beside the bounding cylinder" in str(session.failure)


def test_it_is_a_policy_that_is_given_no_mesh() -> None:
    policy: Policy = surveyed(ball())[0]
    assert list(inspect.signature(UnknownPart).parameters) == ["surroundings", "probe", "bounds", "speed_mm_s"]
    assert not {"mesh", "workpiece", "mesh_file", "path"} & set(Surroundings.__dataclass_fields__)
    assert policy.next_strips()


def test_nothing_that_it_can_reach_is_the_mesh() -> None:
    mesh = cup()
    policy, held = surveyed(mesh)
    run_session(policy, held, 1)
    corners = {tuple(corner) for corner in np.asarray(mesh.vertices).round(9).tolist()}
    reached: dict[int, object] = {}
    waiting: list[object] = [policy]
    while waiting:
        each = waiting.pop()
        if id(each) in reached or isinstance(each, types.ModuleType | types.FunctionType | type):
            continue
        reached[id(each)] = each
        waiting.extend(gc.get_referents(each))
    assert id(mesh) not in reached
    assert not any(isinstance(each, trimesh.Trimesh) for each in reached.values())
    for each in reached.values():
        if isinstance(each, np.ndarray) and each.dtype == np.float64 and each.shape[-1:] == (3,):
            assert len(corners & {tuple(row) for row in each.reshape(-1, 3).round(9).tolist()}) < 3
