"""Connected components: items that are linked in pairs, and corners at one position."""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from planner.arrays import FloatArray, IndexArray


def connected(pairs: IndexArray, count: int) -> IndexArray:
    """Return `(count,)`, the component number (from 0) of each item, for linked pairs `(n, 2)`."""
    links = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    return np.asarray(connected_components(links, directed=False)[1], dtype=np.int64)


def same_position(vertices: FloatArray) -> IndexArray:
    """Return `(n,)`, for each corner of `(n, 3)` the first one at exactly its position."""
    order = np.lexsort(vertices.T)
    ordered = vertices[order]
    is_new = np.concatenate(([True], (ordered[1:] != ordered[:-1]).any(axis=1)))
    firsts = np.minimum.reduceat(order, np.flatnonzero(is_new))
    same = np.empty(len(vertices), dtype=np.int64)
    same[order] = firsts[np.cumsum(is_new) - 1]
    return same
