"""A pattern on a mesh: created on the ideal shape around the part, then moved along each beam to the stand-off."""

from collections.abc import Callable

import numpy as np
import trimesh

from planner.arrays import FloatArray
from planner.cell.cell import Probe
from planner.cell.patterns import PATTERNS, StripLayout
from planner.cell.workpiece import CLASSES, Workpiece
from planner.errors import PathError
from planner.geometry.ray_casting import RayCaster
from planner.geometry.transforms import rigid_inverse

# A pattern whose beams meet the mesh this near to the stand-off is the mesh's own.
_FITS_MM = 1.0
# The probe keeps its stand-off from all of the surface this near to the beam: next to a step it stays above the step.
# A beam that is nearer to a wall is forbidden by the clearance of the map.
_AROUND_MM = 20.0

CLASS_OF_PATTERN = {
    pattern: kind for kind in ("mould", "sphere", "cylinder", "block") for pattern in PATTERNS[kind]
}  # of the two classes that have the same patterns, a block needs no cavity
"""The class that a pattern is laid on where a mesh has none."""


def class_of(kind: str, pattern: str) -> str:
    """Return the class by which a pattern is laid on a mesh: its own where that has the pattern."""
    return kind if pattern in PATTERNS.get(kind, {}) else CLASS_OF_PATTERN[pattern]


def upright(T_TW: FloatArray) -> FloatArray:
    """Return, in the workpiece's frame, the frame `(4, 4)` with its z axis up and the same origin.

    It is the workpiece's frame itself where that stands upright, else it has the table's axes.
    """
    frame = np.eye(4)
    if T_TW[2, 2] < 1.0 - 1e-9:
        frame[:3, :3] = T_TW[:3, :3].T
    return frame


def measured(mesh: trimesh.Trimesh, kind: str, T_TW: FloatArray) -> tuple[Workpiece, FloatArray]:
    """Return a mesh's class with its dimensions as it stands on the table, and the frame `(4, 4)` of these.

    Raises:
        WorkpieceError: The mesh has not the shape that the class needs.
    """
    frame = upright(T_TW)
    standing = mesh.copy()
    standing.apply_transform(rigid_inverse(frame))
    return CLASSES[kind].measured(standing), frame


def mesh_waypoints(
    mesh: trimesh.Trimesh, kind: str, pattern: str, T_TW: FloatArray, probe: Probe, layout: StripLayout
) -> FloatArray:
    """Return the waypoints `(n, 4, 4)` of a pattern over a mesh, in the mesh's frame.

    Args:
        mesh: The part, in mm.
        kind: its class.
        pattern: A pattern of that class.
        T_TW: `(4, 4)`, pose of the part on the table; the pattern is created around the table's vertical axis.
        probe: the probe.
        layout: layout of the strips.

    Raises:
        PathError: No beam meets the mesh, or the pattern has too many strips.
        WorkpieceError: The mesh has not the shape that the class needs.
    """
    workpiece, frame = measured(mesh, kind, T_TW)
    lay: Callable[..., FloatArray] = PATTERNS[kind][pattern]
    return following(frame @ lay(workpiece, probe, layout), mesh, probe.stand_off_mm)


def following(waypoints: FloatArray, mesh: trimesh.Trimesh, stand_off_mm: float) -> FloatArray:
    """Return waypoints `(n, 4, 4)` moved along their beams until the nearest surface around each is at the stand-off.

    If no surface is near a beam, the displacement is interpolated from its neighbors. Waypoints that already fit the
    mesh are not moved.

    Raises:
        PathError: no beam meets the mesh.
    """
    rays = RayCaster(mesh)
    distances_mm = first_distances_mm(rays, mesh, waypoints, np.zeros((1, 2)))[:, 0]
    if np.all(np.abs(distances_mm - stand_off_mm) <= _FITS_MM):
        return waypoints
    nearest_mm = _nearest(first_distances_mm(rays, mesh, waypoints, _disc(_AROUND_MM)))
    met = np.flatnonzero(np.isfinite(nearest_mm))
    if not len(met):
        raise PathError("no beam of the pattern meets the part; choose another pattern")
    ahead_mm = np.interp(np.arange(len(waypoints)), met, nearest_mm[met]) - stand_off_mm
    moved = waypoints.copy()
    moved[:, :3, 3] += ahead_mm[:, np.newaxis] * waypoints[:, :3, 2]
    return moved


def first_distances_mm(rays: RayCaster, mesh: trimesh.Trimesh, poses: FloatArray, beside_mm: FloatArray) -> FloatArray:
    """Return the distance from each probe along its beam to the outermost surface, `(n, m)`; NaN if there is none.

    Args:
        rays: the mesh for ray casting.
        mesh: the same mesh.
        poses: `(n, 4, 4)`, probes, which may be inside the mesh.
        beside_mm: `(m, 2)`, offset of each ray from the beam, along x and y of the probe.
    """
    back_mm = _beyond_mm(mesh, poses)
    starts = poses[:, np.newaxis, :3, 3] + np.einsum("mk,nik->nmi", beside_mm, poses[:, :3, :2])
    starts -= back_mm * poses[:, np.newaxis, :3, 2]
    beams = np.repeat(poses[:, :3, 2], len(beside_mm), axis=0)
    hits = rays.first_hits(starts.reshape(-1, 3), beams)
    return hits.distances_mm.reshape(len(poses), -1) - back_mm


def _beyond_mm(mesh: trimesh.Trimesh, poses: FloatArray) -> float:
    """Return a distance that reaches the outside of the mesh from every probe."""
    away = poses[:, :3, 3] - np.asarray(mesh.bounds).mean(axis=0)
    return float(np.linalg.norm(away, axis=1).max() + np.linalg.norm(mesh.extents))


def _disc(radius_mm: float) -> FloatArray:
    """Return points of a disc, `(17, 2)`: its middle and two rings."""
    turn = np.radians(np.arange(0.0, 360.0, 45.0))
    ring = np.column_stack((np.cos(turn), np.sin(turn)))
    return np.concatenate((np.zeros((1, 2)), 0.5 * radius_mm * ring, radius_mm * ring))


def _nearest(distances_mm: FloatArray) -> FloatArray:
    """Return the minimum of each row `(n, m)`, infinity for a row of NaN."""
    return np.asarray(np.where(np.isfinite(distances_mm), distances_mm, np.inf).min(axis=1))
