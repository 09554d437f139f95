"""Load the mesh of a workpiece, and refuse one that cannot be meant."""

from pathlib import Path

import numpy as np
import trimesh

from planner.arrays import BoolArray, FloatArray
from planner.errors import WorkpieceError

# A part that a probe with a 60 mm line and an arm of 650 mm reach can be meant for.
SMALLEST_MM = 10.0
LARGEST_MM = 1000.0


def radius_about_axis_mm(mesh: trimesh.Trimesh, T_TW: FloatArray) -> float:
    """Return how far the mesh reaches from the table's axis when placed at T_TW `(4, 4)`."""
    vertices = np.asarray(mesh.vertices) @ T_TW[:3, :3].T + T_TW[:3, 3]
    return float(np.hypot(vertices[:, 0], vertices[:, 1]).max())


def load_mesh(file: Path) -> trimesh.Trimesh:
    """Return the mesh of an STL, PLY or OBJ file, in mm, when it is sound.

    Raises:
        WorkpieceError: It cannot be read, is empty, open, inside out or crosses itself, or its size cannot be meant.
    """
    if file.suffix.lower() not in (".stl", ".ply", ".obj"):
        raise WorkpieceError(f"{file}: a mesh file must end in .stl, .ply or .obj")
    try:
        mesh = trimesh.load_mesh(file)
    # trimesh's readers raise whatever the broken bytes lead them to.
    except Exception as error:
        raise WorkpieceError(f"{file}: cannot be read as a mesh ({error})") from error
    fault = mesh_fault(mesh)
    if fault is not None:
        raise WorkpieceError(f"{file}: {fault}")
    return mesh


def mesh_fault(mesh: trimesh.Trimesh) -> str | None:
    """Return why the mesh cannot be a workpiece, or None."""
    return size_fault(mesh) or _surface_fault(mesh)


def size_fault(mesh: trimesh.Trimesh) -> str | None:
    """Return why the mesh is of no size that can be meant, or None."""
    if len(mesh.faces) == 0:
        return "the mesh is empty"
    if not np.isfinite(mesh.vertices).all():
        return "the mesh holds a coordinate that is not a finite number"
    largest_mm = float(np.max(mesh.extents))
    if not SMALLEST_MM <= largest_mm <= LARGEST_MM:
        hint = "; is it in metres?" if largest_mm < SMALLEST_MM else ""
        return (
            f"the workpiece's longest side is {largest_mm:g} mm; allowed is {SMALLEST_MM:g} to {LARGEST_MM:g} mm{hint}"
        )
    return None


def _surface_fault(mesh: trimesh.Trimesh) -> str | None:
    if not mesh.is_watertight:
        return "the mesh is open; a workpiece must be a closed surface"
    if not mesh.is_winding_consistent or mesh.volume <= 0.0:
        return "the mesh is inside out, or its triangles disagree on which side is out"
    crossing = first_crossing(mesh)
    return f"the mesh crosses itself, at triangles {crossing[0]} and {crossing[1]}" if crossing else None


def first_crossing(mesh: trimesh.Trimesh) -> tuple[int, int] | None:
    """Return two triangles (counted from 0) without a common corner of which one's edge pierces the other, or None."""
    triangles = np.asarray(mesh.triangles)
    near, counts = mesh.triangles_tree.intersection_v(triangles.min(axis=1), triangles.max(axis=1))
    pairs = np.column_stack((np.repeat(np.arange(len(triangles)), counts.astype(np.int64)), near))
    shared = (mesh.faces[pairs[:, 0], :, np.newaxis] == mesh.faces[pairs[:, 1], np.newaxis, :]).any(axis=(1, 2))
    pairs = pairs[~shared]
    pierced = np.zeros(len(pairs), dtype=np.bool_)
    for corner in range(3):
        start = triangles[pairs[:, 0], corner]
        end = triangles[pairs[:, 0], (corner + 1) % 3]
        pierced |= _segments_pierce(start, end, triangles[pairs[:, 1]])
    first = np.flatnonzero(pierced)
    return (int(pairs[first[0], 0]), int(pairs[first[0], 1])) if len(first) else None


def _segments_pierce(start: FloatArray, end: FloatArray, triangles: FloatArray) -> BoolArray:
    """Return whether each open segment passes through its closed triangle (Moeller and Trumbore, 1997)."""
    edge_1, edge_2 = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    direction = end - start
    p = np.cross(direction, edge_2)
    determinant = np.sum(edge_1 * p, axis=1)
    crosses_plane = np.abs(determinant) > 1e-12
    scale = 1.0 / np.where(crosses_plane, determinant, 1.0)
    offset = start - triangles[:, 0]
    q = np.cross(offset, edge_1)
    u = np.sum(offset * p, axis=1) * scale
    v = np.sum(direction * q, axis=1) * scale
    t = np.sum(edge_2 * q, axis=1) * scale
    rounding = 1e-9
    within = (u > -rounding) & (v > -rounding) & (u + v < 1.0 + rounding) & (t > rounding) & (t < 1.0 - rounding)
    return np.asarray(crosses_plane & within)
