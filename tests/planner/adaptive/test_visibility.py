import numpy as np
import trimesh

from planner.adaptive.candidates import POSES, directions, following, sweeps
from planner.adaptive.reach import filled_up
from planner.adaptive.visibility import Places, at_nearest, sees
from planner.arrays import FloatArray
from planner.cell.cell import Probe
from planner.geometry.ray_casting import RayCaster
from planner.scanning.coverage import Coverage
from planner.scanning.probe import LaserProbe, Sight
from tests.planner.parts import bracket, joined


def profiles(strip: FloatArray, count: int = 240) -> FloatArray:
    """The poses of the profiles along a strip: every quarter of a mm."""
    at = np.linspace(0.0, len(strip) - 1.0, count)
    before = np.minimum(at.astype(np.int64), len(strip) - 2)
    part = (at - before)[:, np.newaxis]
    T_WS = strip[before].copy()
    T_WS[:, :3, 3] += part * (strip[before + 1, :3, 3] - strip[before, :3, 3])
    return T_WS


def strips_over(mesh: trimesh.Trimesh, count: int) -> tuple[RayCaster, Coverage, FloatArray]:
    caster = RayCaster(mesh)
    coverage = Coverage(mesh, caster, LaserProbe(), 2.0)
    places = Places(coverage.points[:count], coverage.normals[:count])
    number, ways = directions(caster, places, 150.0)
    some = np.linspace(0, len(number) - 1, count).astype(np.int64)
    rolls = np.where(np.arange(count) % 2, 0.0, 90.0)
    return caster, coverage, sweeps(places.points[number[some]], ways[some], rolls, 60.0, Probe())


def test_what_a_strip_is_said_to_see_is_what_its_profiles_see() -> None:
    caster, coverage, straight = strips_over(bracket(), 12)
    bent, moved = following(caster, straight, Probe())
    assert moved.any()
    strips = np.concatenate((straight, bent[moved]))
    places = Places(coverage.points, coverage.normals)
    found = sees(caster, LaserProbe(), strips, np.full(len(strips), POSES - 1), places)
    assert found.any(axis=1).all()
    for strip, promised in zip(strips, found, strict=True):
        coverage.codes[:] = Sight.NEVER_IN_VIEW
        coverage.take(profiles(strip))
        seen = coverage.codes == Sight.SEEN
        assert (seen | ~promised).all()  # what is promised is measured
        assert promised.sum() >= 0.9 * seen.sum()  # and the margins leave little away


def test_poses_that_fill_a_strip_up_see_nothing_more() -> None:
    caster, coverage, strips = strips_over(bracket(), 4)
    places = Places(coverage.points, coverage.normals)
    short = [strip[:3] for strip in strips]
    filled, last = filled_up(short, POSES)
    alone = [sees(caster, LaserProbe(), strip[np.newaxis], np.array([2]), places)[0] for strip in short]
    np.testing.assert_array_equal(sees(caster, LaserProbe(), filled, last, places), alone)
    assert (sees(caster, LaserProbe(), strips, np.full(4, POSES - 1), places).sum(axis=1) > np.sum(alone, axis=1)).any()


def test_a_strip_over_a_hollow_stays_over_its_rim() -> None:
    slab = trimesh.creation.box((200.0, 200.0, 10.0)).apply_translation((0.0, 0.0, -45.0))
    walls = [trimesh.creation.box((60.0, 200.0, 40.0)).apply_translation((x, 0.0, -20.0)) for x in (-70.0, 70.0)]
    caster = RayCaster(joined(slab, *walls))
    # Across the hollow, which is 80 mm wide and 40 deep: its middle pose looks at the bottom, the others at the rim.
    strip = sweeps(np.array([[0.0, 0.0, 0.0]]), np.array([[0.0, 0.0, 1.0]]), np.array([90.0]), 180.0, Probe())
    np.testing.assert_allclose(np.abs(strip[0, :, 0, 3]), (90.0, 45.0, 0.0, 45.0, 90.0), atol=1e-9)
    bent, moved = following(caster, strip, Probe())
    heights = bent[0, :, 2, 3]
    assert moved[0]
    np.testing.assert_allclose(heights[[0, 1, 3, 4]], 150.0, atol=1e-6)
    assert 110.0 < heights[2] < 120.0  # over the bottom the probe sinks, as steeply as a strip may


def test_flags_go_over_to_other_samples_of_the_same_side() -> None:
    """The plate is thinner than its samples are apart."""
    plate = trimesh.creation.box((100.0, 100.0, 0.5))
    coverage = Coverage(plate, RayCaster(plate), LaserProbe(), 2.0)
    other = plate.subdivide()
    points, triangles = trimesh.sample.sample_surface(other, 3000, seed=3)
    others = Places(np.asarray(points), np.asarray(other.face_normals)[triangles])
    flags = at_nearest(coverage.normals[:, 2] > 0.5, Places.of(coverage), others)
    np.testing.assert_array_equal(flags, others.normals[:, 2] > 0.5)
