"""The edges of a triangle mesh: which triangles share an edge, and their direction along it."""

from typing import NamedTuple

import numpy as np

from planner.arrays import BoolArray, FloatArray, IndexArray


class Edges(NamedTuple):
    """The three sides of each triangle, with their edges.

    Attributes:
        ends: `(n_edges, 2)`, the vertices, the smaller index first.
        edge: `(3 n,)`, the edge of each side; the sides of triangle i are 3 i to 3 i + 2.
        forward: `(3 n,)`, whether the triangle runs along the edge from its first end to its second.
        counts: `(n_edges,)`, number of triangles at the edge.
    """

    ends: IndexArray
    edge: IndexArray
    forward: BoolArray
    counts: IndexArray

    def shared_by_two(self) -> tuple[IndexArray, BoolArray]:
        """Return the pairs of triangles `(m, 2)` that alone share an edge, and whether both have the same direction."""
        shared = np.flatnonzero(self.counts[self.edge] == 2)
        sides = shared[np.argsort(self.edge[shared], kind="stable")].reshape(-1, 2)
        return sides // 3, self.forward[sides[:, 0]] == self.forward[sides[:, 1]]

    def middle(self, vertices: FloatArray, edge: int) -> FloatArray:
        """Return the middle `(3,)` of an edge."""
        return np.asarray(vertices[self.ends[edge]].mean(axis=0))


def edges_of(faces: IndexArray) -> Edges:
    """Return the edges of triangles `(n, 3)` given by their vertices."""
    start, end = faces.reshape(-1), np.roll(faces, -1, axis=1).reshape(-1)
    span = int(faces.max(initial=0)) + 1
    keys, edge, counts = np.unique(
        np.minimum(start, end) * span + np.maximum(start, end), return_inverse=True, return_counts=True
    )
    return Edges(np.column_stack((keys // span, keys % span)), edge.reshape(-1), start < end, counts)
