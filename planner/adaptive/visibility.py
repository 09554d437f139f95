"""What a sweep of the probe sees of places on a surface, without taking its profiles one by one.

Between two poses of a sweep the probe moves in proportion, and its profiles lie so close that one passes over every
place there. So a place is asked once for each strip, of the pose whose laser plane holds it: the laser's fan, the
range, the incidence, and the shadows of the laser and of both cameras (`probe.sight`). The limits are drawn in by a
margin, so that what is promised here is also measured.
"""

from dataclasses import dataclass, replace
from math import sqrt
from typing import NamedTuple, Self

import numpy as np
from scipy.spatial import cKDTree

from planner.arrays import BoolArray, FloatArray, IndexArray
from planner.geometry.ray_casting import RayCaster
from planner.kernel import kernel
from planner.scanning.coverage import Coverage
from planner.scanning.probe import LaserProbe, Sight, sight

# Pairs of strip and place whose rays are cast at once, which bounds the memory.
_BLOCK = 200_000
# By how much the limits of the probe are drawn in.
_RANGE_MARGIN_MM = 1.0
_INCIDENCE_MARGIN_DEG = 1.0
_WIDTH_MARGIN = 0.98
# Places whose normals are at right angles count as farther apart by 1.4 times this.
_SIDE_MM = 10.0


@dataclass(frozen=True, eq=False)
class Places:
    """Places on a surface.

    Attributes:
        points: `(m, 3)` in frame W, in mm.
        normals: `(m, 3)` outward normals there, of length 1.
    """

    points: FloatArray
    normals: FloatArray

    def only(self, chosen: BoolArray | IndexArray) -> "Places":
        """Return some of the places."""
        return Places(self.points[chosen], self.normals[chosen])

    @classmethod
    def of(cls, coverage: Coverage) -> Self:
        """Return the places that stand for the surface in a coverage."""
        return cls(coverage.points, coverage.normals)


def at_nearest(flags: BoolArray, places: Places, others: Places) -> BoolArray:
    """Return for each of `n` other places the flag of the nearest of `m` places on the same side of the part.

    Args:
        flags: `(m,)`, one for each of the places.
        places: On a surface.
        others: On about the same surface; the samples of two meshes are not the same even where these agree.
    """
    tree = cKDTree(np.hstack((places.points, _SIDE_MM * places.normals)))
    nearest = tree.query(np.hstack((others.points, _SIDE_MM * others.normals)))[1]
    return np.asarray(flags[nearest])


def cautious(probe: LaserProbe) -> LaserProbe:
    """Return the probe with its limits drawn in by a margin."""
    return replace(
        probe,
        nearest_mm=probe.nearest_mm + _RANGE_MARGIN_MM,
        farthest_mm=probe.farthest_mm - _RANGE_MARGIN_MM,
        half_width=_WIDTH_MARGIN * probe.half_width,
        incidence_limit_deg=probe.incidence_limit_deg - _INCIDENCE_MARGIN_DEG,
    )


class _Passes(NamedTuple):
    """Which strip passes over which place, and the pose of the probe at that moment."""

    strips: IndexArray
    places: IndexArray
    T_WS: FloatArray


def sees(caster: RayCaster, probe: LaserProbe, T_WS: FloatArray, last: IndexArray, places: Places) -> BoolArray:
    """Return which strips see which places, `(n, m)`.

    Args:
        caster: The surface that casts shadows.
        probe: The probe.
        T_WS: `(n, k, 4, 4)` poses of each strip.
        last: `(n,)` the last pose of each strip that counts; strips of fewer poses are filled up behind it.
        places: `m` places.
    """
    seen = np.zeros((len(T_WS), len(places.points)), dtype=np.bool_)
    limits = cautious(probe)
    cosine = float(np.cos(np.radians(limits.incidence_limit_deg)))
    bounds = limits.half_width, limits.nearest_mm, limits.farthest_mm, cosine
    T_WS, points, normals = (np.ascontiguousarray(each) for each in (T_WS, places.points, places.normals))
    first = 0
    while first < len(T_WS):
        strips, where = np.empty(_BLOCK, dtype=np.int64), np.empty(_BLOCK, dtype=np.int64)
        poses = np.tile(np.eye(4), (_BLOCK, 1, 1))
        until, count = _passes(T_WS, last, points, normals, *bounds, first, strips, where, poses)
        if until == first:
            raise ValueError(f"{len(points):,} places on the surface are too many; at most {_BLOCK:,} are allowed")
        passes = _Passes(strips[:count], where[:count], poses[:count])
        good = _is_seen(caster, limits, passes, places)
        seen[passes.strips[good], passes.places[good]] = True
        first = until
    return seen


def _is_seen(caster: RayCaster, probe: LaserProbe, passes: _Passes, places: Places) -> BoolArray:
    """Return for each pass whether the place is measured in it: the way of the laser's ray, then all of `sight`."""
    points, normals = places.points[passes.places], places.normals[passes.places]
    good = caster.can_see(points, normals, passes.T_WS[:, :3, 3])
    struck = np.flatnonzero(good)
    T_WS, points, normals = passes.T_WS[struck], points[struck], normals[struck]
    depths_mm = np.einsum("ij,ij->i", points - T_WS[:, :3, 3], T_WS[:, :3, 2])
    codes = sight(caster, probe, T_WS, np.arange(len(struck)), points, normals, depths_mm)
    good[struck] = codes == Sight.SEEN
    return good


@kernel
def _passes(
    T_WS: FloatArray, last: IndexArray, points: FloatArray, normals: FloatArray,
    half_width: float, nearest_mm: float, farthest_mm: float, cosine: float, first: int,
    strips: IndexArray, places: IndexArray, poses: FloatArray,
) -> tuple[int, int]:  # fmt: skip
    """Write the passes of the strips from `first` on whose range, width and incidence are right, while there is room.

    Returns:
        The first strip that was left out, and the number of passes.
    """
    count = 0
    for strip in range(first, len(T_WS)):
        begin = count
        for place in range(len(points)):
            if count == len(strips):
                return strip, begin
            x, y, z = points[place, 0], points[place, 1], points[place, 2]
            nx, ny, nz = normals[place, 0], normals[place, 1], normals[place, 2]
            ahead = _across(T_WS, strip, 0, x, y, z)
            for k in range(last[strip]):
                behind = _across(T_WS, strip, k + 1, x, y, z)
                if ahead * behind > 0.0 or ahead == behind:
                    ahead = behind
                    continue
                part = ahead / (ahead - behind)
                ahead = behind
                ox, oy, oz = _between(T_WS, strip, k, 3, part)
                ax, ay, az = _between(T_WS, strip, k, 2, part)
                bx, by, bz = _between(T_WS, strip, k, 0, part)
                wx, wy, wz = x - ox, y - oy, z - oz
                depth, aside = wx * ax + wy * ay + wz * az, wx * bx + wy * by + wz * bz
                if not nearest_mm <= depth <= farthest_mm or abs(aside) > half_width * depth:
                    continue
                if -(nx * wx + ny * wy + nz * wz) < cosine * sqrt(wx * wx + wy * wy + wz * wz):
                    continue
                strips[count], places[count] = strip, place
                for row in range(3):
                    for column in range(4):
                        here, there = T_WS[strip, k, row, column], T_WS[strip, k + 1, row, column]
                        poses[count, row, column] = here + part * (there - here)
                count += 1
                break
    return len(T_WS), count


@kernel
def _across(T_WS: FloatArray, strip: int, k: int, x: float, y: float, z: float) -> float:
    """Return how far a point is in front of the laser's plane, along the sweep, in mm."""
    dx, dy, dz = x - T_WS[strip, k, 0, 3], y - T_WS[strip, k, 1, 3], z - T_WS[strip, k, 2, 3]
    across: float = dx * T_WS[strip, k, 0, 1] + dy * T_WS[strip, k, 1, 1] + dz * T_WS[strip, k, 2, 1]
    return across


@kernel
def _between(T_WS: FloatArray, strip: int, k: int, column: int, part: float) -> tuple[float, float, float]:
    """Return a column of the pose between two poses of a strip."""
    x = T_WS[strip, k, 0, column] + part * (T_WS[strip, k + 1, 0, column] - T_WS[strip, k, 0, column])
    y = T_WS[strip, k, 1, column] + part * (T_WS[strip, k + 1, 1, column] - T_WS[strip, k, 1, column])
    z = T_WS[strip, k, 2, column] + part * (T_WS[strip, k + 1, 2, column] - T_WS[strip, k, 2, column])
    return x, y, z
