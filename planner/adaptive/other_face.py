"""Lay a part on another face: the stable pose in which most of what cannot be seen now can be looked at."""

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from planner.adaptive.visibility import Places
from planner.arrays import FloatArray
from planner.errors import WorkpieceError

_LEAST_PROBABLE = 0.01
"""Poses that a dropped part comes to more seldom are not ones that it stands in."""
_LOWEST_COSINE = -0.2
"""How far a face may look down and still be seen from aside."""
_SAME_COSINE = np.cos(np.radians(10.0))
_DOWN = np.array((0.0, 0.0, -1.0))


def other_face(mesh: trimesh.Trimesh, unseen: Places) -> FloatArray:
    """Return the pose `(4, 4)` that lays a part on another face, at the same place on the table.

    The part is turned about a horizontal axis, its box's middle stays where it is, and its base at the same height.

    Args:
        mesh: The part in frame W, in mm.
        unseen: Places on it that cannot be seen as it stands now.

    Raises:
        WorkpieceError: It stands on no other face.
    """
    poses, probabilities = trimesh.poses.compute_stable_poses(mesh)
    best: FloatArray | None = None
    most = -1
    for pose, probability in zip(poses, probabilities, strict=True):
        down = pose[:3, :3].T @ _DOWN
        if probability < _LEAST_PROBABLE or down @ _DOWN > _SAME_COSINE:
            continue
        visible = int((unseen.normals @ -down > _LOWEST_COSINE).sum())
        if visible > most:
            best, most = down, visible
    if best is None:
        raise WorkpieceError("the part stands stably on no other face, so it cannot be turned over")
    return _laid(mesh, best)


def _laid(mesh: trimesh.Trimesh, down: FloatArray) -> FloatArray:
    """Return the pose in which `down` `(3,)` of the part points down, by the shortest turn."""
    axis = np.cross(down, _DOWN)
    sine, cosine = float(np.linalg.norm(axis)), float(down @ _DOWN)
    axis = axis / sine if sine > 1e-9 else np.array((1.0, 0.0, 0.0))
    T = np.eye(4)
    T[:3, :3] = Rotation.from_rotvec(np.arctan2(sine, cosine) * axis).as_matrix()
    lower, upper = np.asarray(mesh.bounds)
    turned = np.asarray(mesh.vertices) @ T[:3, :3].T
    T[:3, 3] = 0.5 * (lower + upper) - 0.5 * (turned.min(axis=0) + turned.max(axis=0))
    T[2, 3] = lower[2] - turned[:, 2].min()
    return T
