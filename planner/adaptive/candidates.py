"""Candidate strips: short sweeps over places that were not seen, in several directions and rolls of the beam.

A beam may look at a place from any direction in which nothing of the part is between them. Of these the reachable ones
are thinned to a few that lie far apart. A strip runs through its place, straight, or following the surface so that the
stand-off is kept; what an obstacle or the arm forbids of it is cut off (`reach`).
"""

from collections.abc import Callable

import numpy as np

from planner.adaptive.visibility import Places
from planner.arrays import BoolArray, FloatArray, IndexArray
from planner.cell.cell import Probe
from planner.cell.scan_path import looking_at
from planner.geometry.ray_casting import RayCaster

POSES = 5
"""Poses of a strip."""
SHORTEST_MM = 60.0
"""Length of the strips over small parts."""
ROLLS_DEG = (0.0, 90.0)
"""How far the laser line is turned about the beam from the level."""
# Directions that are tried, evenly spread over the sphere, and how far off the normal a beam may be.
_DIRECTIONS = 128
_LEAST_COSINE = np.cos(np.radians(58.0))
# How far a following strip may come nearer or go farther from one pose to the next, in mm along the strip.
_STEEPEST = 0.8
# A strip that follows the surface by less than this is as good as straight.
_MOVED_MM = 5.0


def spread(points: FloatArray, count: int) -> IndexArray:
    """Return the indices of up to `count` points `(n, 3)` that lie far from one another (farthest-point sampling)."""
    if len(points) <= count:
        return np.arange(len(points))
    chosen = np.empty(count, dtype=np.int64)
    chosen[0] = 0
    distances2 = np.sum((points - points[0]) ** 2, axis=1)
    for k in range(1, count):
        chosen[k] = np.argmax(distances2)
        distances2 = np.minimum(distances2, np.sum((points - points[chosen[k]]) ** 2, axis=1))
    return chosen


def sphere_directions(count: int) -> FloatArray:
    """Return unit vectors `(count, 3)` that are evenly spread over the sphere (Fibonacci lattice)."""
    k = np.arange(count) + 0.5
    z, turn = 1.0 - 2.0 * k / count, np.pi * (1.0 + np.sqrt(5.0)) * k
    level = np.sqrt(1.0 - z**2)
    return np.column_stack((level * np.cos(turn), level * np.sin(turn), z))


def directions(caster: RayCaster, places: Places, stand_off_mm: float) -> tuple[IndexArray, FloatArray]:
    """Return from where each place can be looked at: the places' numbers `(m,)` and unit vectors `(m, 3)` to the eye.

    The normal of each place comes first among its directions, where it is free.
    """
    lattice = sphere_directions(_DIRECTIONS)
    near = places.normals @ lattice.T >= _LEAST_COSINE
    number, direction = np.nonzero(near)
    number = np.concatenate((np.arange(len(places.points)), number))
    ways = np.concatenate((places.normals, lattice[direction]))
    points, normals = places.points[number], places.normals[number]
    free = caster.can_see(points, normals, points + stand_off_mm * ways)
    number, ways = number[free], ways[free]
    order = np.argsort(number, kind="stable")
    return number[order], ways[order]


def sweeps(points: FloatArray, ways: FloatArray, rolls_deg: FloatArray, length_mm: float, probe: Probe) -> FloatArray:
    """Return straight strips `(n, POSES, 4, 4)` through points `(n, 3)`, seen along -ways `(n, 3)`.

    Args:
        points: On the surface, in frame W.
        ways: Unit vectors from the points to the probe.
        rolls_deg: `(n,)` how far the laser line is turned about the beam from the level.
        length_mm: How long the strips are.
        probe: The probe.
    """
    level = np.cross((0.0, 0.0, 1.0), ways)
    upright = np.linalg.norm(level, axis=1) < 1e-6
    level[upright] = (1.0, 0.0, 0.0)
    level /= np.linalg.norm(level, axis=1, keepdims=True)
    turn = np.radians(rolls_deg)[:, np.newaxis]
    lines = np.cos(turn) * level + np.sin(turn) * np.cross(ways, level)
    T_WS = np.repeat(looking_at(points, ways, lines, probe.stand_off_mm)[:, np.newaxis], POSES, axis=1)
    T_WS[:, :, :3, 3] += along_mm(length_mm)[:, np.newaxis] * T_WS[:, :, :3, 1]
    return T_WS


def along_mm(length_mm: float) -> FloatArray:
    """Return where the poses of a strip are along it, `(POSES,)`, from its middle."""
    return np.linspace(-0.5 * length_mm, 0.5 * length_mm, POSES)


def following(caster: RayCaster, strips: FloatArray, probe: Probe) -> tuple[FloatArray, BoolArray]:
    """Return strips moved along their beams so that the stand-off is kept, and which of them moved by much, `(n,)`.

    Each pose keeps the stand-off from the nearest surface that its laser line meets within the range. The slope of a
    strip is limited, so that over a hollow it stays above the rim.
    """
    n, k = strips.shape[:2]
    across = np.linspace(-0.3, 0.3, 5)[:, np.newaxis] * probe.line_width_mm
    origins = strips[:, :, np.newaxis, :3, 3] + across * strips[:, :, np.newaxis, :3, 0]
    beams = np.repeat(strips[:, :, :3, 2].reshape(-1, 3), len(across), axis=0)
    depths_mm = caster.first_hits(origins.reshape(-1, 3), beams).distances_mm.reshape(n, k, len(across))
    in_range = (depths_mm >= probe.nearest_mm) & (depths_mm <= probe.farthest_mm)
    nearest_mm = np.where(in_range, depths_mm, np.inf).min(axis=2)
    shift_mm = np.where(np.isfinite(nearest_mm), nearest_mm - probe.stand_off_mm, 0.0)
    steepest_mm = _STEEPEST * np.linalg.norm(strips[:, 1, :3, 3] - strips[:, 0, :3, 3], axis=1)
    for pose in range(1, k):
        shift_mm[:, pose] = np.minimum(shift_mm[:, pose], shift_mm[:, pose - 1] + steepest_mm)
    for pose in range(k - 2, -1, -1):
        shift_mm[:, pose] = np.minimum(shift_mm[:, pose], shift_mm[:, pose + 1] + steepest_mm)
    moved = strips.copy()
    moved[:, :, :3, 3] += shift_mm[:, :, np.newaxis] * strips[:, :, :3, 2]
    return moved, np.asarray(np.abs(shift_mm).max(axis=1) > _MOVED_MM)


def candidate_sweeps(
    caster: RayCaster,
    places: Places,
    targets: int,
    most_directions: int,
    longest_mm: float,
    probe: Probe,
    is_reached: Callable[[FloatArray], BoolArray],
) -> FloatArray:
    """Return candidate strips over places `(n, POSES, 4, 4)`: each straight, and following the surface where it bends.

    Args:
        caster: The surface.
        places: Where something is to be seen.
        targets: Over how many of the places strips are laid; these are spread.
        most_directions: From how many directions each is looked at; those that are reached are spread.
        longest_mm: The part's longest side, which strips are half as long as.
        probe: The probe.
        is_reached: Returns for poses `(m, 4, 4)` which the arm can reach at any table angle, `(m,)`.
    """
    chosen = places.only(spread(places.points, targets))
    number, ways = directions(caster, chosen, probe.stand_off_mm)
    length_mm = max(SHORTEST_MM, 0.5 * longest_mm)
    rolled = np.stack(
        [sweeps(chosen.points[number], ways, np.full(len(ways), roll), length_mm, probe) for roll in ROLLS_DEG]
    )
    reached = is_reached(rolled[:, :, POSES // 2].reshape(-1, 4, 4)).reshape(len(ROLLS_DEG), -1)
    kept = np.zeros(len(ways), dtype=np.bool_)
    for target in np.unique(number[reached.any(axis=0)]):
        own = np.flatnonzero((number == target) & reached.any(axis=0))
        kept[own[spread(ways[own], most_directions)]] = True
    straight = rolled[reached & kept]
    bent, moved = following(caster, straight, probe)
    return np.concatenate((straight, bent[moved]))
