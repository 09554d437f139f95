"""Rigid transformations as arrays of homogeneous matrices `(n, 4, 4)`, lengths in mm.

The robot's language writes an orientation as yaw, pitch and roll in the ZYZ' convention: Rz(yaw) Ry(pitch) Rz(roll).
Here this is only an input and output format.
"""

import numpy as np

from planner.arrays import FloatArray

# Precision of a pose that is written with four decimals.
_RIGIDITY_TOLERANCE = 1e-3


def rotations_z(angles_deg: FloatArray) -> FloatArray:
    """Return Rz `(n, 4, 4)` for angles `(n,)` in degrees."""
    return _rotations(angles_deg, 0, 1)


def rotations_y(angles_deg: FloatArray) -> FloatArray:
    """Return Ry `(n, 4, 4)` for angles `(n,)` in degrees."""
    return _rotations(angles_deg, 2, 0)


def _rotations(angles_deg: FloatArray, first: int, second: int) -> FloatArray:
    angles = np.radians(np.atleast_1d(angles_deg))
    T = np.tile(np.eye(4), (len(angles), 1, 1))
    T[:, first, first] = T[:, second, second] = np.cos(angles)
    T[:, second, first] = np.sin(angles)
    T[:, first, second] = -T[:, second, first]
    return T


def from_xyz_yaw_pitch_roll(locations: FloatArray) -> FloatArray:
    """Return `(n, 4, 4)` for rows x y z (mm) yaw pitch roll (deg) `(n, 6)`."""
    locations = np.asarray(locations, dtype=np.float64)
    T = rotations_z(locations[:, 3]) @ rotations_y(locations[:, 4]) @ rotations_z(locations[:, 5])
    T[:, :3, 3] = locations[:, :3]
    return T


def rigid_inverse(T: FloatArray) -> FloatArray:
    """Return the inverses of rigid transformations `(..., 4, 4)`."""
    inverse = np.zeros_like(T)
    inverse[..., :3, :3] = np.swapaxes(T[..., :3, :3], -1, -2)
    inverse[..., :3, 3] = -(inverse[..., :3, :3] @ T[..., :3, 3, np.newaxis])[..., 0]
    inverse[..., 3, 3] = 1.0
    return inverse


def first_not_rigid(T: FloatArray) -> tuple[int, str] | None:
    """Return the index of the first of `(n, 4, 4)` that is not a rigid transformation, and why, or None."""
    for i, pose in enumerate(T):
        R = pose[:3, :3]
        if not np.isfinite(pose).all():
            return i, "holds a value that is not a finite number"
        if np.abs(pose[3] - (0.0, 0.0, 0.0, 1.0)).max() > _RIGIDITY_TOLERANCE:
            return i, "has a last row other than 0 0 0 1"
        if np.abs(R @ R.T - np.eye(3)).max() > _RIGIDITY_TOLERANCE:
            return i, "is not rigid: its axes are not of length 1 at right angles"
        if np.linalg.det(R) < 0.0:
            return i, "is not rigid: its axes are left-handed"
    return None


def nearest_rigid(T: FloatArray) -> FloatArray:
    """Return `(n, 4, 4)` with each rotation replaced by the nearest exact one, which removes the rounding of a file."""
    U, _, Vt = np.linalg.svd(T[:, :3, :3])
    rigid = np.tile(np.eye(4), (len(T), 1, 1))
    rigid[:, :3, :3] = U @ Vt
    rigid[:, :3, 3] = T[:, :3, 3]
    return rigid
