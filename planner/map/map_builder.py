"""Compute configuration maps: f_R of every scan location at every table angle, in one or more arm configurations.

One compiled pass computes a cell completely. The inverse kinematics is computed once for all configurations, and so are
the collisions of the parts on the flange. Each further check is made only for poses that passed the previous ones. The
required memory depends only on the size of the maps.
"""

import hashlib
import math
from collections.abc import Sequence
from dataclasses import asdict
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from planner.arrays import CodeArray, FloatArray, IndexArray
from planner.cell.bodies import FLANGE_FRAME
from planner.cell.clearance import ARM_FRAMES, PLACED, nearest_pair, place_bodies
from planner.cell.collision_model import base_in_obstacles
from planner.kernel import kernel
from planner.kinematics.arm import Arm, link_frames
from planner.kinematics.configuration import Configuration
from planner.kinematics.inverse_kinematics import inverse
from planner.kinematics.value import (
    CLEARANCE_EXPONENT,
    COMFORTABLE_CLEARANCE_MM,
    MINIMUM_CLEARANCE_MM,
    RatedPoses,
    UserFactor,
    clearance_factor,
    joint_ranges,
    joints_value,
    wrist_factor,
)
from planner.map.config_map import DEFAULT_EPSILON, ConfigurationMap, ConfigurationMapError
from planner.map.map_problem import MapProblem
from planner.map.map_reasons import FIRST_PAIR, FIRST_USER_FACTOR, reason_texts
from planner.reasons import Reason
from protocol.kernels.kept_code import is_kept
from protocol.program.progress import Progress

_REACHED = int(Reason.REACHED)
_SINGULAR = int(Reason.SINGULAR)
_JOINT_1_LIMIT = int(Reason.JOINT_1_LIMIT)

NO_POSES = np.empty((0, 0, 0, 6)), np.empty((0, 0, 0))
_MOST_CELLS = 50_000_000
"""Half a gigabyte."""
_BLOCK_CELLS = 16_384
"""Cells between two reports of progress: a few milliseconds, and the maximum size of a block for user factors."""


def build_maps(
    problem: MapProblem,
    configurations: Sequence[Configuration],
    n_angles: int,
    progress: Progress | None = None,
) -> dict[Configuration, ConfigurationMap]:
    """Return the map of each configuration.

    Args:
        problem: the cell, the path, the value function.
        configurations: the arm configurations.
        n_angles: number of table angles over one turn.
        progress: called with the number of finished locations and of all locations, before and after each block. An
            exception that it raises ends the computation.

    Raises:
        ConfigurationMapError: the maps would have too many cells.
        ValueError: a user's factor returned a wrong shape, or values other than numbers in 0..1; or there are more user
            factors or pairs than a map can distinguish.
    """
    user_factors = problem.value.user_factors
    user_names = [factor.name for factor in user_factors]
    texts = reason_texts(problem.pair_names, user_names)
    n_locations = len(problem.T_WS)
    shape = (len(configurations), n_locations, n_angles)
    if math.prod(shape) > _MOST_CELLS:
        raise ConfigurationMapError(
            f"the maps of {n_locations:,} locations and {n_angles:,} angles, for {len(configurations)} of 8"
            f" configurations, have {math.prod(shape):,} cells; at most {_MOST_CELLS:,} are allowed; use fewer angles,"
            " a longer time step, or one configuration"
        )
    values, reasons = np.empty(shape), np.empty(shape, dtype=np.uint8)
    cells = lay_out_cells(problem, configurations, n_angles)
    block = max(1, _BLOCK_CELLS // n_angles)
    if progress is not None:
        progress(0, n_locations)
    for first in range(0, n_locations, block):
        last = min(first + block, n_locations)
        # Of its own, in one piece: parts of the maps would be another type, for which numba compiles once more.
        block_shape = shape[0], last - first, n_angles
        rated = np.empty(block_shape), np.empty(block_shape, dtype=np.uint8)
        if user_factors:
            rate_with_user_factors(cells, problem.cell.arm, user_factors, first, *rated)
        else:
            rate_columns(*cells, first, *rated, *NO_POSES)
        values[:, first:last], reasons[:, first:last] = rated
        if progress is not None:
            progress(last, n_locations)
    metadata = {
        "scan": problem.name,
        "digest": digest_of(cells, user_names),
        "arm": asdict(problem.cell.arm),
        "reasons": texts,
    }
    return {
        configuration: ConfigurationMap(
            values[c], reasons[c], metadata=metadata | {"configuration": configuration.label}
        )
        for c, configuration in enumerate(configurations)
    }


def is_compiled() -> bool:
    """Return whether the machine code for a map is stored from an earlier run."""
    return is_kept(rate_columns)


class Cells(NamedTuple):
    """A map problem as the arrays for the kernel, in its order."""

    arm: FloatArray
    table_poses: FloatArray  # (n_angles, 3, 4): T_BT Rz(theta)
    T_TF: FloatArray
    value: FloatArray
    ranges: FloatArray
    slots: IndexArray
    beam_mm: float
    n_common: int
    pairs: IndexArray
    bodies: FloatArray
    obstacles: FloatArray
    field_values: npt.NDArray[np.float32]
    field_levels: FloatArray
    obstacle_frames: FloatArray  # (n_angles, n_obstacles, 3, 4)


def lay_out_cells(problem: MapProblem, configurations: Sequence[Configuration], n_angles: int) -> Cells:
    """Return a map problem as the kernel takes it."""
    angles_deg = np.linspace(0.0, 360.0, n_angles, endpoint=False)
    model = problem.collision
    return Cells(
        problem.cell.arm.table,
        np.ascontiguousarray(problem.cell.table_factors(angles_deg)[:, :3]),
        np.ascontiguousarray(problem.cell.location_factors(problem.T_WS)),
        problem.value.table,
        joint_ranges(problem.cell.arm),
        np.array(configurations, dtype=np.int64),
        model.beam_mm(problem.cell.probe.stand_off_mm),
        model.n_common,
        model.pairs,
        model.bodies,
        model.obstacles,
        *model.field,
        base_in_obstacles(model, angles_deg),
    )


def digest_of(cells: Cells, user_factor_names: Sequence[str]) -> str:
    """Return a digest of everything that a map depends on, except the requested configurations and users' code."""
    content = hashlib.sha256("\0".join(user_factor_names).encode())
    for array in cells._replace(slots=np.empty(0, dtype=np.int64)):
        content.update(np.ascontiguousarray(array).tobytes())
    return content.hexdigest()[:16]


def rate_with_user_factors(
    cells: Cells,
    arm: Arm,
    factors: Sequence[UserFactor],
    first: int,
    values: FloatArray,
    reasons: CodeArray,
    location: int | None = None,
) -> None:
    """Write f_R and reasons of the columns from `first` on as `rate_columns` does, times the users' factors.

    Args:
        cells: the map problem.
        arm: its arm.
        factors: the users' factors.
        first: the first column, as a row of the cells' goals.
        values: `(n_configurations, n_columns, n_angles)`, written.
        reasons: the same.
        location: the number of the first column's location, where it is not its row.
    """
    location = first if location is None else location
    joints, clearance_mm = np.empty((*values.shape, 6)), np.empty(values.shape)
    rate_columns(*cells, first, values, reasons, joints, clearance_mm)
    alive = np.nonzero(values)
    rated = RatedPoses(
        np.radians(arm.robot_deg(joints[alive])),
        clearance_mm[alive],
        alive[1] + location,
        alive[2] * (360.0 / values.shape[2]),
    )
    value, reason = values[alive], np.zeros(len(alive[0]), dtype=np.uint8)
    for number, factor in enumerate(factors):
        value = value * _rates(factor, rated)
        reason[(value <= DEFAULT_EPSILON) & (reason == _REACHED)] = FIRST_USER_FACTOR + number
    values[alive] = np.where(reason == _REACHED, value, 0.0)
    reasons[alive] = reason


def _rates(factor: UserFactor, poses: RatedPoses) -> FloatArray:
    rates = np.asarray(factor.rate(poses), dtype=np.float64)
    if rates.shape != poses.clearance_mm.shape or not ((rates >= 0.0) & (rates <= 1.0)).all():
        raise ValueError(
            f"the factor {factor.name!r} gave an array of shape {rates.shape} for {len(poses.clearance_mm)} poses, or "
            "a value outside 0..1; it must rate each pose by a number in 0..1"
        )
    return rates


@kernel
def rate_columns(  # noqa: C901 - one pass over plain arrays: calls in between would pass twenty of them on
    arm: FloatArray, table_poses: FloatArray, T_TF: FloatArray, value: FloatArray, ranges: FloatArray,
    slots: IndexArray, beam_mm: float, n_common: int, pairs: IndexArray, bodies: FloatArray,
    obstacles: FloatArray, field_values: npt.NDArray[np.float32], field_levels: FloatArray,
    obstacle_frames: FloatArray, first: int,
    values: FloatArray, reasons: CodeArray, joints_seen: FloatArray, clearance_seen: FloatArray,
) -> None:  # fmt: skip
    """Write f_R and reasons `(n_configurations, n_columns, n_angles)` of the columns from `first` on.

    The joints `(..., 6)` and the clearance of each cell are written too, unless their arrays are empty.
    """
    joints, codes = np.empty((8, 6)), np.empty(8, dtype=np.uint8)
    frames, placed = np.empty((7, 3, 4)), np.empty((len(bodies), PLACED))
    flange, arm_frames = frames[FLANGE_FRAME], frames[:ARM_FRAMES]
    comfortable_mm = value[COMFORTABLE_CLEARANCE_MM]
    for column in range(values.shape[1]):
        for angle in range(values.shape[2]):
            _goal_pose(table_poses, angle, T_TF, first + column, flange)
            inverse(arm, flange, joints, codes)
            # The clearance of the parts on the flange is the same in all configurations; it is computed when first
            # needed.
            common_mm, common_pair = comfortable_mm, -1
            # No part moves with joint 4 or 5, so FLIP and NOFLIP have the same clearance.
            clearance_mm, pair, known_arm = comfortable_mm, -1, -1
            for c in range(len(slots)):
                slot = slots[c]
                rated, reason = 0.0, int(codes[slot])
                if reason == _REACHED:
                    rated, reason = _posture_value(value, joints, ranges, slot)
                if rated > 0.0 and value[CLEARANCE_EXPONENT] > 0.0:
                    if known_arm < 0:
                        place_bodies(bodies, frames, beam_mm, FLANGE_FRAME, FLANGE_FRAME, placed)
                        common_mm, common_pair = nearest_pair(
                            pairs, bodies, obstacles, field_values, field_levels,
                            placed, obstacle_frames, angle, 0, n_common, comfortable_mm,
                        )  # fmt: skip
                    if known_arm != slot >> 1:
                        known_arm = slot >> 1
                        clearance_mm, pair = common_mm, common_pair
                        # A tool that collides does so in every configuration: no further check is needed.
                        if common_mm > value[MINIMUM_CLEARANCE_MM]:
                            link_frames(arm, joints[slot], arm_frames)
                            place_bodies(bodies, frames, beam_mm, 0, ARM_FRAMES - 1, placed)
                            clearance_mm, own_pair = nearest_pair(
                                pairs, bodies, obstacles, field_values, field_levels,
                                placed, obstacle_frames, angle, n_common, len(pairs), common_mm,
                            )  # fmt: skip
                            pair = own_pair if own_pair >= 0 else common_pair
                    rated *= clearance_factor(value, clearance_mm)
                    if rated <= DEFAULT_EPSILON:
                        rated, reason = 0.0, FIRST_PAIR + pair
                values[c, column, angle] = rated
                reasons[c, column, angle] = reason
                if clearance_seen.size > 0:
                    clearance_seen[c, column, angle] = clearance_mm
                    for joint in range(6):  # the assignment of rows would add its error texts to the machine code
                        joints_seen[c, column, angle, joint] = joints[slot, joint]


@kernel
def _goal_pose(table_poses: FloatArray, angle: int, T_TF: FloatArray, location: int, T_BF: FloatArray) -> None:
    for row in range(3):
        r0, r1, r2 = table_poses[angle, row, 0], table_poses[angle, row, 1], table_poses[angle, row, 2]
        for column in range(4):
            T_BF[row, column] = (
                r0 * T_TF[location, 0, column] + r1 * T_TF[location, 1, column] + r2 * T_TF[location, 2, column]
            )
        T_BF[row, 3] += table_poses[angle, row, 3]


@kernel
def _posture_value(value: FloatArray, joints: FloatArray, ranges: FloatArray, slot: int) -> tuple[float, int]:
    """Return the rating by the joints alone and, if it is 0, the reason."""
    product, least, worst = joints_value(value, joints, ranges, slot)
    wrist = wrist_factor(value, joints[slot, 4])
    if product * wrist > DEFAULT_EPSILON:
        return product * wrist, _REACHED
    return 0.0, _SINGULAR if wrist <= least else _JOINT_1_LIMIT + worst
