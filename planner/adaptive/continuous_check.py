"""Is a motion of arm and table free of collisions everywhere, and not only at samples of it?

A motion is halved until each piece is proved free or a pose of it collides (adaptive dynamic collision checking;
Schwarzer, Saha and Latombe, 2005): where the clearance in the middle of a piece is more than anything can move within
its half, the piece is free. Arm and table need not keep step: the arm goes in proportion from one posture to another,
and at every moment the table may be at any angle between its two.
"""

from itertools import product
from typing import NamedTuple

import numpy as np

from planner.arrays import BoolArray, FloatArray
from planner.cell.cell import Cell
from planner.cell.collision_model import CollisionModel
from planner.cell.obstacles import Obstacle, bounding_box
from planner.cell.pose_clearance import clearances

# A piece in which nothing moves by more than this is not halved again: its middle decides.
_FINEST_MM = 0.5
# More pieces than any motion needs that is worth making.
_MOST_PIECES = 20_000
# What a link's hull reaches beyond its axis: more than the widest capsule of the shipped arm.
_HULL_MM = 100.0


class Move(NamedTuple):
    """A motion of the arm in proportion, while the table is anywhere between two angles.

    Attributes:
        start: `(6,)` joints in radians.
        end: `(6,)` joints in radians.
        table_deg: The lowest and the highest angle of the table.
    """

    start: FloatArray
    end: FloatArray
    table_deg: tuple[float, float]


class ContinuousCheck:
    """The cell as motions between strips see it: the beam is off, so it can meet nothing.

    Attributes:
        poses: How many poses were looked at so far.
    """

    def __init__(self, cell: Cell, collision: CollisionModel, solid: Obstacle, minimum_mm: float) -> None:
        """Take over a cell, with something solid on its table; a pose is free with more clearance than `minimum_mm`."""
        beam = len(collision.bodies) - 1
        pairs = collision.pairs[(collision.pairs != beam).all(axis=1)]
        self._collision = collision._replace(pairs=np.ascontiguousarray(pairs))
        self._arm, self._minimum_mm = cell.arm, minimum_mm
        self._joint_radii_mm = joint_radii_mm(cell)
        self._table_radius_mm = turning_radius_mm(solid)
        self.poses = 0

    def clearance_mm(self, joints: FloatArray, table_deg: FloatArray) -> FloatArray:
        """Return the clearance `(n,)` of joints `(n, 6)` at table angles `(n,)`."""
        self.poses += len(joints)
        return clearances(self._collision, self._arm, joints, table_deg, 0.0).clearance_mm

    def is_free(self, move: Move) -> bool:
        """Return whether a motion is free everywhere."""
        # A piece: the middle and half the length, of the arm's way (0 to 1) and of the table's (deg).
        low_deg, high_deg = move.table_deg
        pieces = np.array([[0.5, 0.5, 0.5 * (low_deg + high_deg), 0.5 * (high_deg - low_deg)]])
        arm_mm = float(np.abs(move.end - move.start) @ self._joint_radii_mm)
        table_mm_deg = float(np.radians(self._table_radius_mm))
        while len(pieces):
            if len(pieces) > _MOST_PIECES:
                return False
            joints = move.start + pieces[:, :1] * (move.end - move.start)
            spare_mm = self.clearance_mm(joints, pieces[:, 2]) - self._minimum_mm
            if (spare_mm <= 0.0).any():
                return False
            by_arm_mm, by_table_mm = pieces[:, 1] * arm_mm, pieces[:, 3] * table_mm_deg
            open_ = (by_arm_mm + by_table_mm > spare_mm) & (by_arm_mm + by_table_mm > _FINEST_MM)
            pieces = _halved(pieces[open_], (by_arm_mm >= by_table_mm)[open_])
        return True


def _halved(pieces: FloatArray, along_arm: BoolArray) -> FloatArray:
    """Return the halves of pieces, along the arm's way or along the table's."""
    halves = []
    for side in (-1.0, 1.0):
        half = pieces.copy()
        for middle, length, chosen in ((0, 1, along_arm), (2, 3, ~along_arm)):
            half[chosen, length] *= 0.5
            half[chosen, middle] += side * half[chosen, length]
        halves.append(half)
    return np.concatenate(halves)


def joint_radii_mm(cell: Cell) -> FloatArray:
    """Return how far anything that a joint moves can be from its axis, `(6,)`, in mm: a bound from the lengths."""
    arm = cell.arm
    probe_mm = float(np.linalg.norm(cell.T_FS[:3, 3]) + np.linalg.norm(cell.probe.body_mm))
    links_mm = np.hypot(arm.a_mm, arm.d_mm)
    links_mm[0] = abs(arm.a_mm[0])  # along its own axis a joint moves nothing
    return np.asarray(np.cumsum(links_mm[::-1])[::-1] + probe_mm + _HULL_MM)


def turning_radius_mm(solid: Obstacle) -> float:
    """Return how far anything of an obstacle that turns with the table can be from the table's axis, in mm."""
    corners = np.array(list(product(*np.array(bounding_box(solid)).T)))
    on_table = corners @ solid.pose[:2, :3].T + solid.pose[:2, 3]
    return float(np.hypot(on_table[:, 0], on_table[:, 1]).max())
