"""Make one closed surface from the triangles of a file: positions define the connections, harmless flaws are repaired.

Repairs do not change the shape of the surface. They concern corners that are written more than once, and triangles
without area or written twice. They also concern walls between bodies that share a face, and triangles that are inside
out. A hole is not repaired.
"""

from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from planner.arrays import BoolArray, FloatArray, IndexArray
from planner.errors import WorkpieceError
from planner.geometry.components import connected, same_position
from planner.geometry.edges import edges_of
from planner.geometry.shells import turned_outward

_WELD = 1e-5
"""Corners nearer than this, relative to the longest side of the part, are merged if that closes the surface.

Files round their coordinates.
"""
_FLAT = 1e-20
"""Squared sine of a triangle's angle below which it has no area."""


class ClosedSurface(NamedTuple):
    """A closed surface whose triangles are counterclockwise seen from outside.

    Attributes:
        vertices: `(n, 3)`.
        faces: `(m, 3)`.
        notes: the repairs, each with its count.
    """

    vertices: FloatArray
    faces: IndexArray
    notes: tuple[str, ...]


def closed_surface(vertices: FloatArray, faces: IndexArray) -> ClosedSurface:
    """Return the closed surface of the triangles `(m, 3)` with corners `(n, 3)` in mm.

    Raises:
        WorkpieceError: the surface is not closed; the message states where, in mm.
    """
    surface = _tidied(vertices, faces, same_position(vertices))
    if _open_edges(surface.faces).any():
        welded = _tidied(vertices, faces, _near_position(vertices))
        if not _open_edges(welded.faces).any():
            joined = len(surface.vertices) - len(welded.vertices)
            notes = _counted((joined, "joined {} corner{s} that only rounding keeps apart"))
            surface = welded._replace(notes=(*notes, *welded.notes))
    _check_that_it_is_closed(surface)
    turned = turned_outward(surface.vertices, surface.faces)
    notes = _counted((int(turned.sum()), "turned {} inside-out triangle{s}"))
    outward = np.where(turned[:, np.newaxis], surface.faces[:, ::-1], surface.faces)
    return ClosedSurface(surface.vertices, outward, (*surface.notes, *notes))


def _check_that_it_is_closed(surface: ClosedSurface) -> None:
    if not len(surface.faces):
        raise WorkpieceError("the mesh has no triangle with a nonzero area")
    is_open = np.flatnonzero(_open_edges(surface.faces))
    if len(is_open):
        x, y, z = edges_of(surface.faces).middle(surface.vertices, int(is_open[0]))
        raise WorkpieceError(
            f"the mesh is open at {len(is_open)} edges, the first near x {x:.3f}, y {y:.3f}, z {z:.3f} mm;"
            " a workpiece must be a closed surface"
        )


def _open_edges(faces: IndexArray) -> BoolArray:
    """Return the edges with an odd number of triangles: a closed surface has an even number at each edge."""
    return np.asarray(edges_of(faces).counts % 2 == 1)


def _near_position(vertices: FloatArray) -> IndexArray:
    """Return `(n,)`, for each corner the first one of those connected to it by short steps."""
    pairs = cKDTree(vertices).query_pairs(_WELD * float(np.ptp(vertices, axis=0).max()), output_type="ndarray")
    groups = connected(pairs, len(vertices))
    return np.asarray(np.unique(groups, return_index=True)[1][groups])


def _tidied(vertices: FloatArray, faces: IndexArray, same: IndexArray) -> ClosedSurface:
    """Return the surface with merged corners, and without triangles that cannot be part of it."""
    corners, joined = np.unique(same[faces], return_inverse=True)
    joined = joined.reshape(faces.shape)
    distinct = (joined != np.roll(joined, 1, axis=1)).all(axis=1)
    kept = joined[distinct]
    flat = len(joined) - len(kept)
    single = kept[_without_repeats(kept)]
    needles = _needles(vertices[corners], single)
    if needles.any() and _open_edges(single).any() and not _open_edges(single[~needles]).any():
        flat += int(needles.sum())
        single = single[~needles]
    repeated = len(joined) - flat - len(single)
    notes = _counted((flat, "left out {} triangle{s} without area"), (repeated, "left out {} repeated triangle{s}"))
    return ClosedSurface(vertices[corners], single, notes)


def _needles(vertices: FloatArray, faces: IndexArray) -> BoolArray:
    """Return the triangles whose corners are on one line."""
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    u, v = b - a, c - a
    across = np.cross(u, v)
    longest2 = np.maximum(np.sum(u * u, axis=1), np.sum(v * v, axis=1))
    return np.asarray(np.sum(across * across, axis=1) <= _FLAT * longest2 * longest2)


def _without_repeats(faces: IndexArray) -> BoolArray:
    """Return which triangles to keep of those that share all three corners.

    One stays if the surface needs it. None stays where bodies share a face: without it the surface is closed, and with
    it there would be a third wall at its edge.
    """
    corners = np.sort(faces, axis=1)
    _, first, group, counts = np.unique(corners, axis=0, return_index=True, return_inverse=True, return_counts=True)
    kept = np.zeros(len(faces), dtype=np.bool_)
    kept[first] = True
    if (counts == 1).all():
        return kept
    repeated = np.flatnonzero(counts > 1)
    edges = edges_of(faces)
    edge = edges.edge.reshape(-1, 3)
    # How many triangles that occur once meet at each edge.
    others = np.bincount(edge[counts[group.reshape(-1)] == 1].reshape(-1), minlength=len(edges.counts))
    mine = edge[first[repeated]]
    order = np.argsort(mine, axis=None, kind="stable")
    links = np.column_stack((order[:-1], order[1:]))[np.diff(mine.reshape(-1)[order]) == 0] // 3
    walls = connected(links, len(repeated))
    met = np.bincount(mine.reshape(-1), minlength=len(edges.counts))
    for wall in range(walls.max() + 1):
        at = np.unique(mine[walls == wall])
        if ((others + met)[at] % 2).any() and not (others[at] % 2).any():
            kept[first[repeated[walls == wall]]] = False
    return kept


def _counted(*found: tuple[int, str]) -> tuple[str, ...]:
    """Return the texts with a nonzero count."""
    return tuple(text.format(number, s="" if number == 1 else "s") for number, text in found if number)
