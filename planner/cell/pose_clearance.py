"""The exact clearance of each pose, without the bounds that let the map skip most of its pairs."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from planner.arrays import FloatArray, IndexArray
from planner.cell.bodies import FLANGE_FRAME
from planner.cell.clearance import PLACED, nearest_pair, place_bodies
from planner.cell.collision_model import CollisionModel, base_in_obstacles
from planner.kernel import kernel
from planner.kinematics.arm import Arm, link_frames


class Clearances(NamedTuple):
    """The clearance `(n,)` in mm, and the nearest pair `(n,)` as an index into the model's pairs."""

    clearance_mm: FloatArray
    pair: IndexArray


def clearances(
    model: CollisionModel, arm: Arm, joints: FloatArray, table_angles_deg: FloatArray, stand_off_mm: float
) -> Clearances:
    """Return the clearance of each pose, without a bound.

    Args:
        model: What can collide.
        arm: The arm.
        joints: `(n, 6)`, in radians.
        table_angles_deg: `(n,)`.
        stand_off_mm: The probe's distance from the surface along its beam.

    Raises:
        ValueError: A joint or an angle is not a finite number.
    """
    if not (np.isfinite(joints).all() and np.isfinite(table_angles_deg).all()):
        raise ValueError("a joint or a table angle is not a finite number; only reached poses have a clearance")
    clearance_mm, pair = np.empty(len(joints)), np.empty(len(joints), dtype=np.int64)
    _clearance_of_each(
        arm.table,
        np.ascontiguousarray(joints),
        model.beam_mm(stand_off_mm),
        model.pairs,
        model.bodies,
        model.obstacles,
        *model.field,
        base_in_obstacles(model, table_angles_deg),
        clearance_mm,
        pair,
    )
    return Clearances(clearance_mm, pair)


@kernel
def _clearance_of_each(
    arm: FloatArray, joints: FloatArray, beam_mm: float, pairs: IndexArray, bodies: FloatArray, obstacles: FloatArray,
    field_values: npt.NDArray[np.float32], field_levels: FloatArray,
    obstacle_frames: FloatArray, clearance_mm: FloatArray, pair: IndexArray,
) -> None:  # fmt: skip
    frames, placed = np.empty((7, 3, 4)), np.empty((len(bodies), PLACED))
    for i in range(len(joints)):
        link_frames(arm, joints[i], frames)
        place_bodies(bodies, frames, beam_mm, 0, FLANGE_FRAME, placed)
        clearance_mm[i], pair[i] = nearest_pair(
            pairs, bodies, obstacles, field_values, field_levels,
            placed, obstacle_frames, i, 0, len(pairs), np.inf,
        )  # fmt: skip
