"""Where surface may be that nobody has seen: beyond the rim of the seen surface, and at the edge of unknown space.

Beyond its rim the surface goes on straight, or folds away from the probe or towards it: all three are guessed, and what
is known to be free is taken out.
"""

from typing import NamedTuple

import numpy as np

from planner.adaptive.seen_surface import Estimate, Rim, apart
from planner.adaptive.visibility import Places
from planner.adaptive.voxel_map import FREE, VoxelMap
from planner.arrays import FloatArray, IndexArray

# Places beyond the rim: how far along the surface, how far above it, and how much the normal leans outward.
_BEYOND_MM = ((4.0, 0.0, 0.0), (9.0, 0.0, 0.0), (15.0, 0.0, 0.0), (4.0, -4.0, 1.0), (5.0, 5.0, -1.0))
# Guesses nearer than this to the seen surface are seen.
_SEEN_MM = 3.0
# Side of the cells in which only one guess is kept.
_CELL_MM = 4.0
_FRONTIER_WEIGHT = 0.1


class Guesses(NamedTuple):
    """Guessed places and how much each is worth, `(n,)`."""

    places: Places
    weights: FloatArray


def guesses(estimate: Estimate, voxels: VoxelMap, base_mm: float) -> Guesses:
    """Return the guesses that what is known leaves open.

    Args:
        estimate: The seen surface.
        voxels: The space around it.
        base_mm: Height of the part's base: below it nothing is looked for.
    """
    rim = _beyond(estimate.rim)
    frontier = Places(*voxels.frontier())
    places = Places(np.concatenate((rim.points, frontier.points)), np.concatenate((rim.normals, frontier.normals)))
    weights = np.repeat((1.0, _FRONTIER_WEIGHT), (len(rim.points), len(frontier.points)))
    open_space = (voxels.states_at(places.points) != FREE) & (places.points[:, 2] > base_mm)
    kept = np.flatnonzero(open_space)
    kept = kept[apart(places.points[kept], estimate.points, _SEEN_MM)]
    kept = kept[_one_each(places.points[kept])]
    return Guesses(places.only(kept), weights[kept])


def _beyond(rim: Rim) -> Places:
    """Return the places beyond a rim, those that are most likely first."""
    points, normals = [], []
    for along_mm, above_mm, lean in _BEYOND_MM:
        points.append(rim.points + along_mm * rim.outward + above_mm * rim.normals)
        leaning = rim.normals + lean * rim.outward
        normals.append(leaning / np.linalg.norm(leaning, axis=1, keepdims=True))
    return Places(np.concatenate(points), np.concatenate(normals))


def _one_each(points: FloatArray) -> IndexArray:
    """Return the indices of the first point of each cell, ascending."""
    _, first = np.unique(np.floor(points / _CELL_MM), axis=0, return_index=True)
    return np.sort(first)
