"""The arm on the way of the table, step by step: its joints at the exact angles, on turns that go on from the last."""

import numpy as np

from planner.arrays import CodeArray, FloatArray
from planner.cell.cell import Cell
from planner.kernel import kernel
from planner.kinematics.configuration import Configuration
from planner.kinematics.inverse_kinematics import inverse_kinematics
from planner.kinematics.joint_path import joint_path
from planner.kinematics.wrist_turn import turns_the_long_way
from planner.reasons import Reason

_UNSOLVED = (Reason.OUT_OF_REACH, Reason.SINGULAR)
_TURN = 2.0 * np.pi
_ROUNDING = 1e-9


class FollowedArm:
    """An arm in one configuration, and the flange's goals at the locations that are known."""

    def __init__(self, cell: Cell, configuration: Configuration, step_s: float) -> None:
        """Follow with the arm of `cell`, one location each `step_s`."""
        self._cell, self._configuration, self._step_s = cell, configuration, step_s
        self._limits = *cell.arm.limits, np.radians(cell.arm.max_speed_deg_s) * step_s

    def follow(self, joints: FloatArray, T_TF: FloatArray, angles_deg: FloatArray) -> FloatArray | None:
        """Return the joints (n, 6) along n steps from joints (6,), in radians; None where a limit forbids them.

        Joint limits count with all turns, and no joint is faster than its maximum speed; see `joint_path`.

        Args:
            joints: where the arm is.
            T_TF: (n, 4, 4) the goals at the locations of the steps' ends.
            angles_deg: (n,) the table's angles there.
        """
        solved, reasons = self._solve(T_TF, angles_deg)
        if np.isin(reasons, _UNSOLVED).any():
            return None
        solved = np.ascontiguousarray(solved)
        return solved if _continue_turns(joints, solved, *self._limits) else None

    def arrive(self, T_TF: FloatArray, angle_deg: float, before: FloatArray | None = None) -> FloatArray | None:
        """Return the joints (6,) at a location (4, 4) where the arm has all the time that it needs; None: none.

        On the turn nearest the middle of the range, or nearest the joints `before`.
        """
        solved, reasons = self._solve(T_TF[np.newaxis], np.array([angle_deg]))
        path = joint_path(self._cell.arm, solved, reasons, self._step_s, before)
        return None if path.step is not None else path.joints[0]

    def begin(self, T_TF: FloatArray, angles_deg: FloatArray) -> FloatArray | None:
        """Return the joints (6,) to begin a path with: on the turns that can follow it farthest; None: not its start.

        Args:
            T_TF: (n, 4, 4) the goals along the path.
            angles_deg: (n,) the table's angles there.
        """
        solved, reasons = self._solve(T_TF, angles_deg)
        reached = int(np.argmin(np.append(~np.isin(reasons, _UNSOLVED), False)))
        path = joint_path(self._cell.arm, solved[:reached], reasons[:reached], self._step_s) if reached else None
        return None if path is None or path.step == 0 else path.joints[0]

    def robot_deg(self, joints: FloatArray) -> FloatArray:
        """Return the robot's own angles (..., 6) of joints in radians."""
        return self._cell.arm.robot_deg(joints)

    def _solve(self, T_TF: FloatArray, angles_deg: FloatArray) -> tuple[FloatArray, CodeArray]:
        joints, reasons = inverse_kinematics(self._cell.arm, self._cell.table_factors(angles_deg) @ T_TF)
        return joints[:, self._configuration], reasons[:, self._configuration]


@kernel
def _continue_turns(
    start: FloatArray, joints: FloatArray, lower: FloatArray, upper: FloatArray, most: FloatArray
) -> bool:
    """Put joints (n, 6), in place, on the turns nearest those before; return whether the arm can follow from a start.

    Args:
        start: (6,) where the arm is.
        joints: on any turn.
        lower: (6,) lower joint limits.
        upper: (6,) upper ones.
        most: (6,) how far a joint moves in a step at most.
    """
    before = start
    for k in range(len(joints)):
        row = joints[k]
        for j in range(6):
            row[j] -= _TURN * np.rint((row[j] - before[j]) / _TURN)
            is_slow = abs(row[j] - before[j]) <= most[j] * (1.0 + _ROUNDING)
            if not (is_slow and lower[j] <= row[j] <= upper[j]):
                return False
        if turns_the_long_way(before[4], row[4], row[3] - before[3], row[5] - before[5]):
            return False
        before = row
    return True
