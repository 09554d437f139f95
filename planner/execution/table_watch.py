"""Monitor a moving table: poll its position (H) and read its latch at each scan location (L).

The ground truth is read too, if possible.

None of this delays a command: a reading that would not finish in time is postponed.
"""

from collections.abc import Callable

import numpy as np

from planner.execution.run_record import Observation, Record
from planner.execution.table_motion import MotionInTime
from planner.table.wire import Wire
from protocol import TableClient, TableError
from protocol.bench import GroundTruth
from protocol.program.progress import Progress

# Number of bytes of H, or of L, and of its reply.
_QUESTION_BYTES, _ANSWER_BYTES = 2, 10
# Deviation of a table at rest from its target: 0.05 deg, plus the rounding of its reply.
_AT_REST_DEG = 0.15
# A reading that took longer has no certain time: the operating system was busy.
_CERTAIN_S = 0.01
# A reading of the position that has waited this long precedes a trigger.
_OVERDUE_S = 0.25


class StrayedError(TableError):
    """The position of the table deviates from the plan."""


class TableWatch:
    """Monitors one motion. All times are in the time of the motion; its time 0 is `origin_s` of the record."""

    def __init__(
        self,
        table: TableClient,
        motion: MotionInTime,
        wire: Wire,
        record: Record,
        tolerance_deg: float,
        poll_s: float,
        look_s: float,
        view: GroundTruth | None = None,
        progress: Progress | None = None,
    ) -> None:
        """Monitor a motion.

        Args:
            table: the client at the table's port.
            motion: the planned motion of the table.
            wire: duration of readings.
            record: stores the readings.
            tolerance_deg: maximum deviation of the encoder from the plan.
            poll_s: minimum time from one reading of the position to the next.
            look_s: the same for readings of the ground truth.
            view: access to the ground truth of the table; then the triggers are sent through it too.
            progress: called with the time of the motion and its end, in ms.
        """
        self._table, self._motion, self._wire, self._record = table, motion, wire, record
        self._tolerance_deg, self._poll_s, self._look_s = tolerance_deg, poll_s, look_s
        self._view, self._progress = view, progress
        self._column = 0  # whose trigger comes next
        self._next_poll_s = self._next_look_s = motion.start_s

    def now_s(self) -> float:
        """Return the time of the motion."""
        return self._table.clock.now_s() - self._record.origin_s

    def sleep_until(self, time_s: float) -> None:
        """Sleep, and read the ground truth meanwhile if possible."""
        while (left_s := time_s - self.now_s()) > 0.0:
            if self._view is None:
                self._table.clock.sleep_s(left_s)
                continue
            look_in_s = self._next_look_s - self.now_s()
            if look_in_s <= 0.0:
                self._look()
            else:
                self._table.clock.sleep_s(min(left_s, look_in_s))

    def read_until(self, time_s: float, take: Callable[[float, float], None]) -> None:
        """Read latch and position as often as time allows, then sleep.

        Args:
            time_s: time of return.
            take: called with the time and the position of each encoder reading with a certain time.

        Raises:
            StrayedError: the position of the table deviates from the plan.
        """
        reading_s = self._wire.seconds(_QUESTION_BYTES + _ANSWER_BYTES) + self._wire.turnaround_s
        while True:
            column_s = self._motion.column_time_s(self._column)
            now_s = self.now_s()
            poll_s = max(now_s, self._next_poll_s)
            # Triggers come first, but L does not show a position error: frequent triggers must not displace H.
            is_overdue = now_s - self._next_poll_s > _OVERDUE_S
            is_trigger = poll_s + reading_s > column_s and not is_overdue
            begin_s = max(now_s, column_s) if is_trigger else poll_s
            if begin_s + reading_s > time_s:
                break
            self.sleep_until(begin_s)
            if is_trigger:
                self._latch()
            else:
                self._poll(take)
        self.sleep_until(time_s)

    def wait_for_rest(self, target_deg: float) -> None:
        """Wait until the table stands at its target.

        Raises:
            ArrivalTimeout: it did not arrive.
        """
        position_deg = self._table.wait_until_at(target_deg, _AT_REST_DEG, timeout_s=3.0)
        self._see(Observation(self.now_s(), "H", position_deg))

    def _latch(self) -> None:
        """Send the trigger if this program has to, and read the latch.

        Unlike H, L is not compared with the plan: it returns the position at the last trigger that the table detected.
        A missed trigger costs one profile (`planner.scanning.latching`) and must not stop the table.
        """
        column, self._column = self._column, self._column + 1
        time_s = self._motion.column_time_s(column)  # a real probe sent it then
        if self._view is not None:
            time_s = self.now_s()
            self._view.trigger()
            self._look(column)
        self._see(Observation(time_s, "L", self._table.latched_deg(), column))

    def _poll(self, take: Callable[[float, float], None]) -> None:
        """Read the position, and stop the run if it deviates from the plan."""
        self._next_poll_s = self.now_s() + self._poll_s
        time_s = self.now_s() + self._wire.seconds(_QUESTION_BYTES)
        position_deg = self._table.position_deg()
        # The table read its encoder in this interval: mostly at its start, if the reply is in time.
        answered_s = self.now_s() - self._wire.seconds(_ANSWER_BYTES)
        is_certain = answered_s - time_s < _CERTAIN_S
        self._see(Observation(time_s, "H" if is_certain else "H late", position_deg))
        self._check(position_deg, time_s, max(time_s, answered_s))
        if is_certain:
            take(time_s, position_deg)

    def _check(self, position_deg: float, earliest_s: float, latest_s: float) -> None:
        """Stop the run if the position deviates from the plan over an interval."""
        planned_deg = [self._motion.state_at(time_s).angle_deg for time_s in np.linspace(earliest_s, latest_s, 5)]
        off_deg = max(min(planned_deg) - position_deg, position_deg - max(planned_deg))
        if off_deg > self._tolerance_deg:
            raise StrayedError(
                f"at {earliest_s:.2f} s the table is at {position_deg:.1f} deg and should be at {planned_deg[0]:.1f},"
                f" more than {self._tolerance_deg:g} deg off; check that the table turns freely"
            )

    def _see(self, observation: Observation) -> None:
        self._record.observations.append(observation)
        if self._progress is not None:
            self._progress(round(1000.0 * observation.time_s), round(1000.0 * self._motion.end_s))

    def _look(self, column: int | None = None) -> None:
        assert self._view is not None
        begin_s = self.now_s()
        look = self._view.status()
        end_s = self.now_s()
        self._next_look_s = end_s + self._look_s
        if column is not None or end_s - begin_s < _CERTAIN_S:
            time_s = 0.5 * (begin_s + end_s)
            self._record.observations.append(
                Observation(time_s, "inside", look.encoder_deg, column, look.reference_deg, look.true_deg)
            )
