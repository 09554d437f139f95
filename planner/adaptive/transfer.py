"""From one strip to the next: the probe retracts along its beam, the arm moves, the table turns, the probe approaches.

Two ways are tried. Directly, while the table turns; or by a clear posture, in which the table may stand at any angle:
there it turns. Every way is checked for joint limits and, everywhere along it, for collisions. The arm moves at a share
of its joint speeds.
"""

from dataclasses import dataclass
from itertools import islice, pairwise, permutations, product
from typing import NamedTuple

import numpy as np

from planner.adaptive.continuous_check import ContinuousCheck, Move, turning_radius_mm
from planner.arrays import FloatArray
from planner.cell.cell import Cell
from planner.cell.obstacles import Obstacle, bounding_box
from planner.cell.scan_path import looking_at
from planner.geometry.transforms import rigid_inverse, rotations_z
from planner.kinematics.arm import Arm
from planner.kinematics.configuration import Configuration
from planner.kinematics.inverse_kinematics import inverse_kinematics
from planner.reasons import Reason
from planner.table.motion import Limits
from protocol.trapezoid import MotionCommand, ReferenceState, time_to_rest_s

SPEED_SHARE = 0.5
"""Of the joints' maximum speeds, that the arm uses between strips: it starts, stops, and rounds no corner."""
_RETRACT_STEP_MM = 10.0
_RETRACTIONS_MM = (40.0, 100.0, 180.0, 0.0)
_TURN = 2.0 * np.pi
# Clear postures: how far above the part and aside of it the probe is, how far its look leans, and how many are kept.
_ABOVE_MM = (60.0, 140.0, 220.0)
_ASIDE_MM = 80.0
_TILTS_DEG = (0.0, 30.0, 60.0)
_MOST_CLEAR = 8
# Ways by clear postures that are tried.
_MOST_WAYS = 24


class Stance(NamedTuple):
    """Arm and table at one end of a strip.

    Attributes:
        joints: `(6,)` in radians.
        table_deg: The table's angle.
        configuration: The arm's.
    """

    joints: FloatArray
    table_deg: float
    configuration: Configuration


@dataclass(frozen=True, eq=False)
class Transfer:
    """A checked way from one stance to another.

    Attributes:
        joints: `(n, 6)` postures in radians, between which the arm moves in proportion.
        moves_s: `(n - 1,)` times of these motions.
        table_s: How long the table turns.
        is_direct: Whether the table turns while the arm goes from retracted to retracted; else it turns while the arm
            stands in the first clear posture.
        retraction: How many of the motions retract the probe.
        approach: How many of the motions, the last ones, bring it near.
    """

    joints: FloatArray
    moves_s: FloatArray
    table_s: float
    is_direct: bool
    retraction: int
    approach: int

    @property
    def duration_s(self) -> float:
        """How long it takes."""
        arm_s = float(self.moves_s.sum())
        if not self.is_direct:
            return arm_s + self.table_s
        across_s = float(self.moves_s[self.retraction])
        return arm_s - across_s + max(across_s, self.table_s)


_NO_WAY = "the arm has no way to it that is free of collisions"


class Transfers:
    """Finds ways between stances in one cell."""

    def __init__(self, cell: Cell, limits: Limits, check: ContinuousCheck, solid: Obstacle) -> None:
        """Look for clear postures around something solid on the table."""
        self._cell, self._limits, self._check = cell, limits, check
        self._clear = clear_postures(cell, check, solid)

    def between(self, start: Stance | None, end: Stance | None) -> Transfer | str:
        """Return a way from one stance to another, or in a clause why there is none.

        None stands for a clear posture, whichever suits: before the first strip and after the last one.
        """
        if start is not None and end is not None and (direct := self._direct(start, end)) is not None:
            return direct
        for postures in self._by_length(start, end):
            for out_mm, in_mm in product(_RETRACTIONS_MM if start else (0.0,), _RETRACTIONS_MM if end else (0.0,)):
                way = self._way(start, end, postures, out_mm, in_mm)
                if way is not None:
                    return way
        return _NO_WAY

    def _direct(self, start: Stance, end: Stance) -> Transfer | None:
        """Return the way on which the table turns while the arm moves from retracted to retracted."""
        for out_mm, in_mm in product(_RETRACTIONS_MM, _RETRACTIONS_MM):
            way = self._way(start, end, (), out_mm, in_mm)
            if way is not None:
                return way
        return None

    def _by_length(self, start: Stance | None, end: Stance | None) -> list[tuple[FloatArray, ...]]:
        """Return the clear postures, and the pairs of them, the shortest ways first."""
        ends = [each.joints for each in (start, end) if each is not None]
        ways = [(each,) for each in self._clear] + list(permutations(self._clear, 2))
        lengths_s = [sum(self._time_s(a, b) for a, b in pairwise([*ends[:1], *way, *ends[1:]])) for way in ways]
        return [ways[k] for k in np.argsort(lengths_s, kind="stable")[:_MOST_WAYS]]

    def _way(
        self,
        start: Stance | None,
        end: Stance | None,
        clear: tuple[FloatArray, ...],
        out_mm: float,
        in_mm: float,
    ) -> Transfer | None:
        """Return one way, if it is free: out along the beam, by clear postures, in along the beam."""
        first = self._retracted(start, out_mm) if start else []
        last = self._retracted(end, in_mm) if end else []
        if first is None or last is None:
            return None
        before, after = ([each.table_deg] if each else [] for each in (start, end))
        angles_deg = [*before, *after]
        lowest_deg, highest_deg = min(angles_deg), max(angles_deg)
        joints = [*first, *clear, *last[::-1]]
        # With clear postures the table turns while the arm stands in the first of them.
        turning_at = len(first) if clear else None
        for k, (a, b) in enumerate(pairwise(joints)):
            if turning_at is not None:
                at_deg = angles_deg[0] if k < turning_at else angles_deg[-1]
                move = Move(a, b, (at_deg, at_deg))
            elif k < len(first) - 1:
                move = Move(a, b, (angles_deg[0], angles_deg[0]))
            elif k >= len(first):
                move = Move(a, b, (angles_deg[-1], angles_deg[-1]))
            else:
                move = Move(a, b, (lowest_deg, highest_deg))
            if not self._check.is_free(move):
                return None
        moves_s = np.array([self._time_s(a, b) for a, b in pairwise(joints)])
        turn = MotionCommand(angles_deg[-1], *self._limits)
        table_s = time_to_rest_s(ReferenceState(angles_deg[0], 0.0), turn)
        return Transfer(np.array(joints), moves_s, table_s, not clear, max(0, len(first) - 1), max(0, len(last) - 1))

    def _time_s(self, start: FloatArray, end: FloatArray) -> float:
        return move_time_s(self._cell.arm, start, end)

    def _retracted(self, stance: Stance, back_mm: float) -> list[FloatArray] | None:
        """Return the postures from a stance back along its beam; None where the arm cannot go so far."""
        cell = self._cell
        T_BF = cell.arm.flange_poses(stance.joints[np.newaxis])
        count = int(np.ceil(back_mm / _RETRACT_STEP_MM))
        T_BS = np.repeat(T_BF @ cell.T_FS, count, axis=0)
        T_BS[:, :3, 3] -= np.linspace(0.0, back_mm, count + 1)[1:, np.newaxis] * T_BS[:, :3, 2]
        solved, reasons = inverse_kinematics(cell.arm, T_BS @ rigid_inverse(cell.T_FS))
        if (reasons[:, stance.configuration] != Reason.REACHED).any():
            return None
        postures = [stance.joints]
        for joints in solved[:, stance.configuration]:
            postures.append(joints + _TURN * np.rint((postures[-1] - joints) / _TURN))
        lower, upper = cell.arm.limits
        within = all(((joints >= lower) & (joints <= upper)).all() for joints in postures[1:])
        return postures if within else None


def move_time_s(arm: Arm, start: FloatArray, end: FloatArray) -> float:
    """Return how long the arm takes from one posture `(6,)` to another at its share of the joint speeds."""
    return float(np.max(np.degrees(np.abs(end - start)) / (SPEED_SHARE * np.array(arm.max_speed_deg_s))))


def clear_postures(cell: Cell, check: ContinuousCheck, solid: Obstacle) -> list[FloatArray]:
    """Return postures `(6,)` in which nothing is in the way however the table turns, in any arm configuration.

    The probe is above the part, or between the part and the arm, and looks down or at the table's axis.
    """
    radius_mm, height_mm = turning_radius_mm(solid), _height_mm(solid)
    to_arm = -cell.T_BT[:2, 3] @ cell.T_BT[:2, :2]
    to_arm = np.append(to_arm / np.linalg.norm(to_arm), 0.0)
    up = np.array([0.0, 0.0, 1.0])
    places = [
        away_mm * to_arm + (height_mm + above_mm) * up
        for above_mm, away_mm in product(_ABOVE_MM, (0.0, radius_mm + _ASIDE_MM))
    ]
    looks = [np.cos(tilt) * up + np.sin(tilt) * to_arm for tilt in np.radians(_TILTS_DEG)]
    across = np.cross(up, to_arm)
    points, normals = (np.array(each) for each in zip(*product(places, looks), strict=True))
    T_TS = looking_at(points, normals, np.tile(across, (len(points), 1)), 0.0)
    T_TS = np.concatenate((T_TS, T_TS @ rotations_z(np.array([90.0])), T_TS @ rotations_z(np.array([180.0]))))
    solved, reasons = inverse_kinematics(cell.arm, cell.T_BT @ T_TS @ rigid_inverse(cell.T_FS))
    found = solved[reasons == Reason.REACHED]
    at_0 = check.clearance_mm(found, np.zeros(len(found)))
    found = found[np.argsort(-at_0, kind="stable")]
    return list(islice((q for q in found if check.is_free(Move(q, q, (0.0, 360.0)))), _MOST_CLEAR))


def _height_mm(solid: Obstacle) -> float:
    """Return how high an obstacle can reach above the table's top, in mm."""
    corners = np.array(list(product(*np.array(bounding_box(solid)).T)))
    return float((corners @ solid.pose[2, :3] + solid.pose[2, 3]).max())
