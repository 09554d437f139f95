"""What was not seen, as connected regions of the surface, each with its area and the reason that dominates.

The surface is known by places spread evenly over it. Two unseen places belong to the same region where they are
neighbors on the same side of the part.
"""

from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from planner.arrays import BoolArray, CodeArray, FloatArray, IndexArray
from planner.scanning.coverage import Coverage
from planner.scanning.probe import Sight

# Neighbors are at most so many mean spacings apart: a place then has a dozen of them, if all are unseen.
_NEIGHBORS = 2.0


class Region(NamedTuple):
    """A connected part of the surface that was not seen.

    Attributes:
        area_mm2: Its area.
        center_W: `(3,)` the mean of its places, in frame W, in mm.
        normal_W: `(3,)` the mean of their outward normals.
        reason: The condition that fails in most of it.
        can_be_seen_mm2: The area that some strip would see.
    """

    area_mm2: float
    center_W: FloatArray
    normal_W: FloatArray
    reason: Sight
    can_be_seen_mm2: float


def unseen_regions(coverage: Coverage, visible: BoolArray, area_mm2: float) -> list[Region]:
    """Return the regions that were not seen, the largest first.

    Args:
        coverage: What was seen, and why not the rest.
        visible: `(m,)` which of its places some strip would see.
        area_mm2: Of the whole surface.
    """
    unseen = np.flatnonzero(coverage.codes != Sight.SEEN)
    share_mm2 = area_mm2 / len(coverage.codes)
    points, normals = coverage.points[unseen], coverage.normals[unseen]
    numbers = connected(points, normals, _NEIGHBORS * np.sqrt(share_mm2))
    regions = [
        Region(
            share_mm2 * len(own),
            coverage.points[own].mean(axis=0),
            coverage.normals[own].mean(axis=0),
            dominant(coverage.codes[own]),
            share_mm2 * int(visible[own].sum()),
        )
        for own in (unseen[numbers == number] for number in range(numbers.max(initial=-1) + 1))
    ]
    return sorted(regions, key=lambda region: -region.area_mm2)


def connected(points: FloatArray, normals: FloatArray, distance_mm: float) -> IndexArray:
    """Return the number of the connected group that each point `(n, 3)` belongs to, `(n,)`.

    Points up to `distance_mm` apart are neighbors, unless their normals `(n, 3)` look opposite ways: a thin wall has
    two sides.
    """
    if not len(points):
        return np.zeros(0, dtype=np.int64)
    pairs = cKDTree(points).query_pairs(distance_mm, output_type="ndarray")
    pairs = pairs[np.einsum("ij,ij->i", normals[pairs[:, 0]], normals[pairs[:, 1]]) > 0.0]
    links = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(points), len(points)))
    return np.asarray(connected_components(links, directed=False)[1], dtype=np.int64)


def dominant(codes: CodeArray) -> Sight:
    """Return the state that most of the codes `(n,)` name."""
    return Sight(int(np.bincount(codes, minlength=len(Sight)).argmax()))
