"""Find the class that is nearest to a mesh, so that its scan can start with a suitable pattern."""

from typing import NamedTuple

import numpy as np
import trimesh

from planner.arrays import FloatArray
from planner.cell.workpiece import Mould, Sphere
from planner.errors import WorkpieceError

# Tolerance for a sphere, and for a round outline, of a mesh and of gear teeth.
_SPHERE_ERROR = 0.03
_ROUND_RATIO = 1.06
# Below this height a horizontal probe would touch the table.
_LOW_MM = 80.0
_FLAT_RATIO = 0.35
_BOX_FILL = 0.7
_LEAST_CAVITY_SHARE = 0.2


class PartClass(NamedTuple):
    """The shape of a part.

    Attributes:
        kind: its class in a scan file.
        name: its everyday name.
    """

    kind: str
    name: str


def part_class(mesh: trimesh.Trimesh) -> PartClass:
    """Return the class that is nearest to an upright mesh in mm."""
    length_mm, width_mm, height_mm = (float(side) for side in mesh.extents)
    if _is_sphere(mesh):
        return PartClass("sphere", "sphere")
    is_low = height_mm < _LOW_MM or height_mm < _FLAT_RATIO * min(length_mm, width_mm)
    if _is_round(mesh):
        return PartClass("block", "flat turned part") if is_low else PartClass("cylinder", "turned part")
    if _has_cavity(mesh):
        return PartClass("mould", "mould")
    if height_mm < _FLAT_RATIO * min(length_mm, width_mm):
        return PartClass("block", "plate")
    name = "box-like part" if mesh.volume > _BOX_FILL * length_mm * width_mm * height_mm else "free form"
    return PartClass("block" if is_low else "cylinder", name)


def _is_sphere(mesh: trimesh.Trimesh) -> bool:
    ball = Sphere.measured(mesh)
    radius_mm = 0.5 * ball.diameter_mm
    middle = np.add(ball.middle_mm, (0.0, 0.0, radius_mm))
    # The corners of a cube are on a sphere, the middles of its triangles are not.
    points = np.concatenate((np.asarray(mesh.vertices), np.asarray(mesh.triangles_center)))
    error_mm = np.abs(np.linalg.norm(points - middle, axis=1) - radius_mm).max()
    is_whole = float(np.min(mesh.extents)) > 1.6 * radius_mm
    return is_whole and bool(error_mm < _SPHERE_ERROR * radius_mm)


def _is_round(mesh: trimesh.Trimesh) -> bool:
    """Return whether the outline from above has about the same distance from its middle in all directions."""
    lower, upper = np.asarray(mesh.bounds)
    outline: FloatArray = np.asarray(mesh.vertices)[:, :2] - 0.5 * (lower + upper)[:2]
    turn = np.radians(np.arange(0.0, 360.0, 7.5))
    reach_mm = (outline @ np.array((np.cos(turn), np.sin(turn)))).max(axis=0)
    return bool(reach_mm.max() < _ROUND_RATIO * reach_mm.min())


def _has_cavity(mesh: trimesh.Trimesh) -> bool:
    try:
        mould = Mould.measured(mesh)
    except WorkpieceError:
        return False
    share = mould.cavity_length_mm * mould.cavity_width_mm / (mould.length_mm * mould.width_mm)
    return mould.cavity_depth_mm > 2.0 and share > _LEAST_CAVITY_SHARE
