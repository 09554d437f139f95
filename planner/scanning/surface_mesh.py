"""A triangle mesh of a cloud: screened Poisson reconstruction by gpytoolbox, without the parts that it makes up.

Poisson reconstruction returns a closed surface and spans what nobody measured. Triangles that are far from every point
of the cloud are taken out again: a hole in the cloud stays a hole in the mesh.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np
import trimesh
from scipy.spatial import cKDTree

from planner.arrays import FloatArray, IndexArray
from protocol.files.whole_file import whole_file

_DEEPEST = 10
"""Levels of the octree: 1024 cells along the part."""
_MARGIN = 1.1
"""How much longer the octree's side is than the cloud's longest: the library's choice."""
_NEAR_CELLS = 2.0
"""Octree cells from the nearest point within which a corner of the surface was measured."""


class SurfaceMesh(NamedTuple):
    """A surface through a cloud.

    Attributes:
        vertices: `(n, 3)` in mm.
        faces: `(m, 3)`.
        cell_mm: Side of the octree's smallest cell: finer details are smoothed.
        made_up: Share of the reconstructed area that was taken out because nobody measured there.
    """

    vertices: FloatArray
    faces: IndexArray
    cell_mm: float
    made_up: float


def surface_mesh(points: FloatArray, normals: FloatArray, spacing_mm: float) -> SurfaceMesh:
    """Return the surface through points `(n, 3)` in mm with outward normals `(n, 3)`.

    Args:
        points: The thinned cloud.
        normals: Its normals.
        spacing_mm: The distance of neighboring points; the octree is twice as coarse.
    """
    from gpytoolbox import point_cloud_to_mesh  # noqa: PLC0415  # an extra: only who asks for a surface needs it

    side_mm = _MARGIN * float(np.ptp(points, axis=0).max())
    depth = int(np.clip(np.ceil(np.log2(side_mm / (2.0 * spacing_mm))), 4, _DEEPEST))
    cell_mm = side_mm / 2**depth
    vertices, faces = point_cloud_to_mesh(points, normals, psr_depth=depth)
    vertices, faces = np.asarray(vertices, dtype=np.float64), np.asarray(faces, dtype=np.int64)
    distances_mm, _ = cKDTree(points).query(vertices)
    measured = (distances_mm <= _NEAR_CELLS * max(cell_mm, spacing_mm))[faces].all(axis=1)
    areas = np.asarray(trimesh.Trimesh(vertices, faces, process=False).area_faces)
    kept = np.unique(faces[measured])
    number = np.zeros(len(vertices), dtype=np.int64)
    number[kept] = np.arange(len(kept))
    made_up = 1.0 - float(areas[measured].sum() / areas.sum())
    return SurfaceMesh(vertices[kept], number[faces[measured]], cell_mm, made_up)


def save_surface(file: Path, surface: SurfaceMesh) -> None:
    """Write a surface as a binary PLY file, which appears when it is whole."""
    mesh = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
    with whole_file(file) as partial:
        mesh.export(partial, file_type="ply")
