"""The shells of a closed surface (its connected parts), and the material side of each.

The orientation of a shell's triangles is not reliable: many programs write it inside out. The surrounding shells give
more information:

- A shell that nothing surrounds is the outside of a body, with either orientation.
- The same applies to a shell in the cavity of a body.
- A shell in the material of a body bounds a cavity if its orientation is opposite to that of the body's own shell.
  With the same orientation, it is a body within a body: both stay material, so that none is taken for free space.
"""

import numpy as np

from planner.arrays import BoolArray, FloatArray, IndexArray
from planner.errors import WorkpieceError
from planner.geometry.components import connected, same_position
from planner.geometry.edges import Edges, edges_of
from planner.geometry.winding_number import solid_angles

_ASKED_POINTS = 24
"""Number of points of a shell that are tested for being inside another shell: some may be on it, where bodies touch."""


def turned_outward(vertices: FloatArray, faces: IndexArray) -> BoolArray:
    """Return which triangles `(n,)` must be reversed so that all of them have the material behind them.

    Args:
        vertices: `(m, 3)`; equal positions are one vertex.
        faces: `(n, 3)`, a closed surface.

    Raises:
        WorkpieceError: a shell has no two sides, or bodies touch so that the inside is ambiguous.
    """
    faces = same_position(vertices)[faces]
    edges = edges_of(faces)
    patches = connected(edges.shared_by_two()[0], len(faces))
    turned = _turned_to_agree(edges, patches)
    shells = _shells(edges, patches)
    _check_that_sides_agree(vertices, edges, shells, turned)
    agreeing = np.where(turned[:, np.newaxis], faces[:, ::-1], faces)
    volumes = _volumes(vertices, agreeing, shells)
    wrong = np.sign(volumes) * _matter(vertices, agreeing, shells, volumes) < 0.0
    return np.asarray(turned ^ wrong[shells])


def _turned_to_agree(edges: Edges, patches: IndexArray) -> BoolArray:
    """Return the triangles with an orientation opposite to most of their patch."""
    pairs, disagree = edges.shared_by_two()
    n = len(patches)
    # Each triangle twice, as it is and reversed; compatible ones are connected.
    other = pairs[:, 1] + n * disagree
    as_it_is = np.column_stack((pairs[:, 0], other))
    sides = connected(np.concatenate((as_it_is, (as_it_is + n) % (2 * n))), 2 * n)
    first = np.unique(patches, return_index=True)[1]
    turned = sides[:n] != sides[first[patches]]
    mostly = np.bincount(patches, turned) > 0.5 * np.bincount(patches)
    return np.asarray(turned ^ mostly[patches])


def _shells(edges: Edges, patches: IndexArray) -> IndexArray:
    """Return `(n,)`, the shell of each triangle: its patch if it is closed, else with adjacent open patches."""
    crowded = np.flatnonzero(edges.counts[edges.edge] > 2)
    if not len(crowded):
        return patches
    at = np.column_stack((edges.edge[crowded], patches[crowded // 3]))
    met, counts = np.unique(at, axis=0, return_counts=True)
    is_open = np.zeros(patches.max() + 1, dtype=np.bool_)
    is_open[met[counts % 2 == 1, 1]] = True
    # Open patches at the same edge belong together.
    met = met[is_open[met[:, 1]]]
    neighbors = np.column_stack((met[:-1], met[1:]))
    neighbors = neighbors[neighbors[:, 0] == neighbors[:, 2]][:, [1, 3]]
    return connected(neighbors, len(is_open))[patches]


def _check_that_sides_agree(vertices: FloatArray, edges: Edges, shells: IndexArray, turned: BoolArray) -> None:
    runs = np.where(edges.forward ^ np.repeat(turned, 3), 1, -1)
    keys = edges.edge * (shells.max() + 1) + np.repeat(shells, 3)
    at, place = np.unique(keys, return_inverse=True)
    excess = np.flatnonzero(np.bincount(place.reshape(-1), runs))
    if len(excess):
        x, y, z = edges.middle(vertices, int(at[excess[0]] // (shells.max() + 1)))
        raise WorkpieceError(
            f"the triangles are oriented inconsistently, at {len(excess)} edges, the first near"
            f" x {x:.3f}, y {y:.3f}, z {z:.3f} mm"
        )


def _volumes(vertices: FloatArray, faces: IndexArray, shells: IndexArray) -> FloatArray:
    a, b, c = np.moveaxis((vertices - vertices.mean(axis=0))[faces], 1, 0)
    return np.asarray(np.bincount(shells, np.einsum("ij,ij->i", a, np.cross(b, c)) / 6.0))


def _matter(vertices: FloatArray, faces: IndexArray, shells: IndexArray, volumes: FloatArray) -> IndexArray:
    """Return `(n_shells,)`: 1 for a shell with material inside, -1 for the boundary of a cavity."""
    n = len(volumes)
    inside = _inside(vertices, faces, shells, np.abs(volumes))
    written = np.where(volumes < 0.0, -1, 1)
    steps, depths, senses = np.ones(n, dtype=np.int64), np.zeros(n, dtype=np.int64), written.copy()
    for shell in np.argsort(-np.abs(volumes), kind="stable"):
        around = np.flatnonzero(inside[shell])
        if not len(around):
            depths[shell] = 1
            continue
        parent = around[np.argmin(np.abs(volumes[around]))]
        if depths[parent] > 0:  # in material: the orientation relative to its body decides
            senses[shell] = senses[parent]
            steps[shell] = written[shell] * senses[parent]
        depths[shell] = depths[parent] + steps[shell]
    return steps


def _inside(vertices: FloatArray, faces: IndexArray, shells: IndexArray, sizes: FloatArray) -> BoolArray:
    """Return `(n_shells, n_shells)`: whether the first shell is inside the second, larger one."""
    n = len(sizes)
    inside = np.zeros((n, n), dtype=np.bool_)
    if n == 1:
        return inside
    triangles = vertices[faces]
    order = np.argsort(shells, kind="stable")
    parts = np.split(order, np.cumsum(np.bincount(shells))[:-1])
    lower = np.array([triangles[part].min(axis=(0, 1)) for part in parts])
    upper = np.array([triangles[part].max(axis=(0, 1)) for part in parts])
    boxed = (lower[:, np.newaxis] >= lower).all(axis=2) & (upper[:, np.newaxis] <= upper).all(axis=2)
    for inner, outer in np.argwhere(boxed & (sizes[:, np.newaxis] < sizes)):
        chosen = parts[inner][:: max(1, len(parts[inner]) // _ASKED_POINTS)][:_ASKED_POINTS]
        windings = np.abs(solid_angles(triangles[parts[outer]], triangles[chosen].mean(axis=1))) / (4.0 * np.pi)
        # A point on the shell itself sees half of the solid angle; the point with the largest deviation from that
        # decides.
        inside[inner, outer] = windings[np.argmax(np.abs(windings - 0.5))] > 0.5
    return inside
