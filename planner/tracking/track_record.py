"""What was decided while a path was tracked: from it follow the plan that was carried out, its map, and the figures."""

import tempfile
from array import array
from pathlib import Path

import numpy as np

from planner.arrays import CodeArray, FloatArray
from planner.execution.table_motion import Phase
from planner.kinematics.configuration import Configuration
from planner.plans.plan import Pause, Wait
from planner.tracking.online_planner import Kind, State, Step, Why
from planner.tracking.tracker import Column, Tracked

# Of so many moments the whole decision is kept, evenly over the scan.
_MOMENTS = 64


class TrackRecord:
    """What a tracker did; columns go to a file, so that memory grows by some numbers a step only.

    Attributes:
        configuration: of the arm at the start.
        decision_s: how long each step's decision took, with its new columns and its command.
        whys: how many steps were chosen for which reason.
        moments: some decisions.
        T_WS: the locations that were revealed.
    """

    def __init__(self, folder: Path, start: State, configuration: Configuration) -> None:
        """Record from a start; columns are kept in an unnamed file in `folder`."""
        self._file = tempfile.TemporaryFile(dir=folder)  # noqa: SIM115 - as long as the record
        self.configuration = configuration
        self._angle_count = 0
        self._motion = array("d", [start.angle_deg, 0.0, 0.0])
        self._joints: list[FloatArray] = [] if start.joints is None else [start.joints]
        self._waits: dict[int, float] = {}
        self._pauses: list[Pause] = []
        self.T_WS: list[FloatArray] = []
        self.decision_s = array("d")
        self.whys = dict.fromkeys(Why, 0)
        self.moments: list[Step] = []
        self._steps, self._stride = 0, 1

    def close(self) -> None:
        """Let the columns go."""
        self._file.close()

    def revealed(self, column: Column) -> None:
        """Record a column; a column that is already known replaces the earlier one."""
        self._angle_count = len(column.values)
        self._file.seek(column.location * 9 * self._angle_count)
        self._file.write(column.values.tobytes() + column.reasons.tobytes())
        self.T_WS[column.location : column.location + 1] = [column.T_WS]

    def tracked(self, tracked: Tracked, seconds: float) -> None:
        """Record a command, and the step that it starts."""
        for column in tracked.recounted:
            self.revealed(column)
        leg = tracked.command.leg
        step = tracked.step
        if step is None:
            if leg.phase is Phase.WAIT:
                self._waits[leg.column] = self._waits.get(leg.column, 0.0) + leg.duration_s
            return
        self.decision_s.append(seconds)
        self.whys[step.why] += 1
        if step.kind in (Kind.WAIT, Kind.HALT):
            location = step.end.location
            self._waits[location] = self._waits.get(location, 0.0) + leg.duration_s
            return
        if step.kind is Kind.PAUSE:
            changed = tracked.configuration.label if tracked.recounted else None
            self._pauses.append(Pause(step.start.location, step.start.angle_deg, step.end.angle_deg, changed))
        self._motion.extend((step.end.angle_deg, step.end.speed_deg_s, step.acceleration_deg_s2))
        if step.end.joints is not None:
            self._joints.append(step.end.joints)
        self._keep_moment(step)

    @property
    def location_count(self) -> int:
        """How many locations were reached."""
        return len(self._motion) // 3

    @property
    def pauses(self) -> tuple[Pause, ...]:
        """Where the scan paused."""
        return tuple(self._pauses)

    @property
    def waits(self) -> tuple[Wait, ...]:
        """Where it waited."""
        return tuple(Wait(location, duration_s) for location, duration_s in sorted(self._waits.items()))

    def motion(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the angles (n + 1,), the speeds (n + 1,) and the accelerations (n,)."""
        rows = np.array(self._motion).reshape(-1, 3)
        return rows[:, 0].copy(), rows[:, 1].copy(), rows[1:, 2].copy()

    def joints(self) -> FloatArray:
        """Return the joints (n + 1, 6) in radians."""
        return np.array(self._joints)

    def columns(self) -> tuple[FloatArray, CodeArray]:
        """Return f_R and the reasons, (n + 1, n_angles), of the locations that were reached."""
        self._file.seek(0)
        size = 9 * self._angle_count
        raw = np.frombuffer(self._file.read(self.location_count * size), dtype=np.uint8).reshape(-1, size)
        split = 8 * self._angle_count
        return np.ascontiguousarray(raw[:, :split]).view(np.float64), raw[:, split:].copy()

    def _keep_moment(self, step: Step) -> None:
        if self._steps % self._stride == 0:
            self.moments.append(step)
        self._steps += 1
        if len(self.moments) > _MOMENTS:
            self.moments = self.moments[::2]
            self._stride *= 2
