"""The obstacles in the cell: the table on its base, the floor, and the workpiece.

Shapes are exact solids, or the signed distance field of a mesh.
"""

from typing import NamedTuple

import numpy as np

from planner.arrays import FloatArray
from planner.cell.cell import Cell
from planner.cell.scan import Scan
from planner.cell.workpiece import Cylinder, Sphere
from planner.geometry.box_distance import FIELD
from planner.geometry.signed_distance_field import SignedDistanceField, cached_field
from planner.geometry.solid import BOX, CAPSULE, CYLINDER
from protocol.program.progress import Progress

_FLOOR_SIDE_MM = 10_000.0
_FLOOR_THICKNESS_MM = 100.0
_FIELD_POINTS = 120_000
"""Number of grid points of a workpiece's field.

A block of 200 mm has a spacing of 4 mm, and a map's look-ups stay in the processor's cache."""


class Obstacle(NamedTuple):
    """An object in the cell that the arm can hit.

    Attributes:
        name: its name in reasons.
        kind: BOX, CYLINDER or CAPSULE of `planner.geometry.solid`, or FIELD.
        size_mm: `(3,)`, depends on the kind; unused for a field.
        pose: `(4, 4)`, the shape's frame in the table's frame if it turns with the table, else in the base's frame.
        turning: whether it turns with the table.
        field: the field, for that kind.
        stops_light: whether the beam must not pass it. Space that nobody has seen is solid for the arm alone.
    """

    name: str
    kind: int
    size_mm: FloatArray
    pose: FloatArray
    turning: bool
    field: SignedDistanceField | None = None
    stops_light: bool = True


def box(name: str, lengths_mm: tuple[float, float, float], pose: FloatArray, *, turning: bool) -> Obstacle:
    """Return a box with full lengths along x, y and z, centered on `pose`."""
    return Obstacle(name, BOX, np.array(lengths_mm, dtype=np.float64) / 2, pose, turning)


def cylinder(name: str, radius_mm: float, height_mm: float, pose: FloatArray, *, turning: bool) -> Obstacle:
    """Return a cylinder along z, centered on `pose`."""
    return Obstacle(name, CYLINDER, np.array([radius_mm, height_mm / 2, 0.0]), pose, turning)


def sphere(name: str, radius_mm: float, pose: FloatArray, *, turning: bool) -> Obstacle:
    """Return a sphere: a capsule of length 0."""
    return Obstacle(name, CAPSULE, np.array([radius_mm, 0.0, 0.0]), pose, turning)


def bounding_box(obstacle: Obstacle) -> tuple[FloatArray, FloatArray]:
    """Return the minimum and maximum x y z `(3,)` in mm of an obstacle in its own frame."""
    if obstacle.field is not None:
        values, origin = obstacle.field.finest()
        return origin, origin + obstacle.field.spacing_mm * (np.array(values.shape) - 1)
    a, b, c = obstacle.size_mm
    half = {BOX: (a, b, c), CYLINDER: (a, a, b), CAPSULE: (a, a, a + b)}[obstacle.kind]
    return -np.array(half), np.array(half)


def cell_obstacles(cell: Cell) -> tuple[Obstacle, ...]:
    """Return the table, its base and the floor, the plane z = 0 of frame B."""
    table = cell.table
    disc = cylinder("table", table.radius_mm, table.thickness_mm, _at_height(-table.thickness_mm / 2), turning=True)
    floor = box(
        "floor",
        (_FLOOR_SIDE_MM, _FLOOR_SIDE_MM, _FLOOR_THICKNESS_MM),
        _at_height(-_FLOOR_THICKNESS_MM / 2),
        turning=False,
    )
    height_mm = float(cell.T_BT[2, 3]) - table.thickness_mm
    if height_mm <= 0.0:
        return disc, floor
    plinth = cylinder(
        "plinth",
        table.plinth_radius_mm,
        height_mm,
        _at_height(-table.thickness_mm - height_mm / 2),
        turning=True,  # it does not, but a body of revolution around the table's axis looks the same
    )
    return disc, plinth, floor


def workpiece_obstacle(scan: Scan, progress: Progress | None = None) -> Obstacle:
    """Return a scan's workpiece: an ideal sphere or cylinder as such, any other shape as the field of its mesh.

    Args:
        scan: the scan.
        progress: see `signed_distance_field.build_field`; called only if the field is not in the cache.
    """
    T_TW, workpiece = scan.cell.T_TW, scan.workpiece
    # The class may also have been derived from a mesh file; then the mesh is the obstacle.
    if scan.mesh_file is None and isinstance(workpiece, Sphere):
        radius_mm = workpiece.diameter_mm / 2
        return sphere("workpiece", radius_mm, _based(T_TW, workpiece.middle_mm, radius_mm), turning=True)
    if scan.mesh_file is None and isinstance(workpiece, Cylinder):
        pose = _based(T_TW, workpiece.middle_mm, workpiece.height_mm / 2)
        return cylinder("workpiece", workpiece.diameter_mm / 2, workpiece.height_mm, pose, turning=True)
    spacing_mm = float(np.cbrt(np.prod(scan.mesh.extents) / _FIELD_POINTS))
    field = cached_field(scan.mesh, spacing_mm, progress)
    return Obstacle("workpiece", FIELD, np.zeros(3), T_TW, turning=True, field=field)


def _based(T_TW: FloatArray, middle_mm: tuple[float, float, float], height_mm: float) -> FloatArray:
    """Return the pose `height_mm` above the middle of the workpiece's base."""
    offset = np.eye(4)
    offset[:3, 3] = np.add(middle_mm, (0.0, 0.0, height_mm))
    return T_TW @ offset


def _at_height(height_mm: float) -> FloatArray:
    pose = np.eye(4)
    pose[2, 3] = height_mm
    return pose
