"""Load the mesh of a workpiece, and refuse one that is not plausible."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import trimesh

from planner.arrays import FloatArray, IndexArray
from planner.defaults import MILLIMETERS
from planner.errors import WorkpieceError
from planner.geometry.closed_surface import closed_surface
from planner.geometry.crossing import first_crossing
from planner.geometry.mesh_file import read_mesh_file
from protocol.program.progress import Progress

# Plausible sizes of a part for a probe with a line of 60 mm and an arm with a reach of 650 mm.
SMALLEST_MM = 10.0
LARGEST_MM = 1000.0

_ASKED = {"m": "meters", "cm": "centimeters", "inch": "inches"}


def radius_about_axis_mm(mesh: trimesh.Trimesh, T_TW: FloatArray) -> float:
    """Return the maximum distance of the mesh from the table's axis when placed at T_TW `(4, 4)`."""
    vertices = np.asarray(mesh.vertices) @ T_TW[:3, :3].T + T_TW[:3, 3]
    return float(np.hypot(vertices[:, 0], vertices[:, 1]).max())


def load_mesh(
    file: Path,
    unit: str | None = None,
    say: Callable[[str], None] | None = None,
    progress: Progress | None = None,
) -> trimesh.Trimesh:
    """Return the mesh of an STL, PLY or OBJ file, in mm, if it is valid.

    Args:
        file: the file.
        unit: its unit of length, one of `MILLIMETERS`. Without a unit, mm is assumed, and the message about a size that
            fits another unit suggests that unit.
        say: called with one line if harmless flaws were repaired.
        progress: called with the number of checked triangles and of all triangles during the check for crossings.

    Raises:
        WorkpieceError: the file cannot be read, the mesh is empty, open or crosses itself, or its size is not
            plausible.
    """
    content = read_mesh_file(file)
    try:
        mesh, mended = sound_mesh(content.vertices * MILLIMETERS[unit or "mm"], content.faces, unit, progress)
    except WorkpieceError as error:
        raise WorkpieceError(f"{file}: {error}") from error
    notes = (*content.notes, *mended)
    if notes and say is not None:
        say(f"{file}: {'; '.join(notes)}")
    return mesh


def sound_mesh(
    vertices: FloatArray, faces: IndexArray, unit: str | None = None, progress: Progress | None = None
) -> tuple[trimesh.Trimesh, tuple[str, ...]]:
    """Return the mesh of triangles `(m, 3)` with corners `(n, 3)` in mm, and its repairs.

    Raises:
        WorkpieceError: see `load_mesh`.
    """
    if len(faces) == 0:
        raise WorkpieceError("the mesh is empty")
    infinite = int(np.sum(~np.isfinite(vertices[faces]).all(axis=(1, 2))))
    if infinite:
        raise WorkpieceError(f"the mesh holds a coordinate that is not a finite number, in {infinite} triangles")
    fault = size_fault(np.ptp(vertices[faces], axis=(0, 1)), ask=unit is None)
    if fault is not None:
        raise WorkpieceError(f"{fault} Then set unit in [workpiece], or --unit" if fault.endswith("?") else fault)
    surface = closed_surface(vertices, faces)
    mesh = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
    crossing = first_crossing(mesh, progress)
    if crossing is not None:
        x, y, z = crossing
        raise WorkpieceError(f"the mesh crosses itself near x {x:.3f}, y {y:.3f}, z {z:.3f} mm")
    return mesh, surface.notes


def size_fault(extents_mm: FloatArray, *, ask: bool = True) -> str | None:
    """Return why a workpiece with sides `(3,)` has no plausible size, or None.

    Args:
        extents_mm: the sides.
        ask: whether to suggest another unit of length that fits.
    """
    largest_mm = float(np.max(extents_mm))
    if SMALLEST_MM <= largest_mm <= LARGEST_MM:
        return None
    fault = f"the workpiece's longest side is {largest_mm:g} mm; allowed: {SMALLEST_MM:g} to {LARGEST_MM:g} mm"
    others = [name for unit, name in _ASKED.items() if SMALLEST_MM <= largest_mm * MILLIMETERS[unit] <= LARGEST_MM]
    return f"{fault}; is it in {' or '.join(others)}?" if ask and others else fault
