"""Correct a stream while it runs: for late commands, and for a table whose clock drifts.

A stream is computed before the motion, from the predicted reference (`stream`). A late command, or a table with another
clock, changes the reference. Therefore the reference is simulated by the controller's rules, from each command as it
was sent, and shifted by the deviation of the encoder readings. If it is too far from the position that the next command
expects, the rest of the motion is streamed again from the actual position.
"""

from collections.abc import Iterator
from itertools import islice

from planner.execution.run_on import latest_s
from planner.execution.run_record import Correction
from planner.execution.stream import Streaming, TimedCommand, check_it_fits
from planner.execution.table_motion import TableMotion
from planner.table.motion import Limits
from planner.table.wire import Wire, exchanges_s
from protocol.trapezoid import MotionCommand, ReferenceState

# A larger deviation of the reference from the stream requires a new stream.
_SLIP_DEG = 0.03


class FollowedReference:
    """Where the reference is, by the commands that were sent and the readings of the encoder.

    Attributes:
        running: the last command that was sent: its time, and the reference at that time.
    """

    def __init__(self, drift_deg: float, drift_filter_s: float, encoder_delay_s: float) -> None:
        """Follow from rest.

        Args:
            drift_deg: maximum deviation of the readings from their prediction; beyond it the reference is shifted.
            drift_filter_s: averaging time of the readings for this.
            encoder_delay_s: delay of the encoder behind the reference of the stream.
        """
        self.running: TimedCommand | None = None
        self._drift_deg, self._encoder_delay_s = drift_deg, encoder_delay_s
        self._drift = _Drift(drift_filter_s)

    def latest_s(self, timed: TimedCommand) -> float:
        """Return the maximum delay of a command: the previous one is valid for this much longer than its step."""
        return latest_s((self.running or timed).leg.duration_s)

    def sent(self, timed: TimedCommand, late_s: float) -> None:
        """Record that the next command was sent, and its delay."""
        time_s = timed.time_s + max(0.0, late_s)
        there = timed.expected if self.running is None else self.running.reference_at(time_s)
        self.running = timed._replace(time_s=time_s, expected=there)

    def encoder_read(self, time_s: float, angle_deg: float) -> None:
        """Record the position of the encoder at a time that is known exactly."""
        running = self.running
        if running is not None and (reference_s := time_s - self._encoder_delay_s) >= running.time_s:
            self._drift.take(time_s, angle_deg - running.reference_at(reference_s).angle_deg)

    def moved_by_drift(self) -> float:
        """Shift the reference by the deviation of the readings, if that is large; return the shift."""
        drift_deg = self._drift.estimate_deg
        if self.running is None or abs(drift_deg) <= self._drift_deg:
            return 0.0
        angle_deg, speed_deg_s = self.running.expected
        self.running = self.running._replace(expected=ReferenceState(angle_deg + drift_deg, speed_deg_s))
        self._drift.forget()
        return drift_deg


class CorrectedStream(FollowedReference):
    """The commands of a motion, one after the other. All times are in the time of the motion.

    Attributes:
        corrections: the points where the commands were computed again.
    """

    def __init__(
        self,
        motion: TableMotion,
        limits: Limits,
        wire: Wire,
        drift_deg: float,
        drift_filter_s: float,
        encoder_delay_s: float,
        run_on_deg: float,
    ) -> None:
        """Compute the stream.

        Args:
            motion: the planned motion of the table.
            limits: maximum S and A.
            wire: properties of the serial line.
            drift_deg: maximum deviation of the readings from their prediction; beyond it the reference is shifted.
            drift_filter_s: averaging time of the readings for this.
            encoder_delay_s: delay of the encoder behind the reference of the stream.
            run_on_deg: maximum angle that the table may run on if the line fails.

        Raises:
            StreamError: the serial line is too slow for the commands.
        """
        super().__init__(drift_deg, drift_filter_s, encoder_delay_s)
        self.corrections: list[Correction] = []
        self._streaming = Streaming(motion, limits, wire, run_on_deg)
        self._commands = list(self._streaming.commands())
        self._rest: Iterator[TimedCommand] = iter(())  # computed when they are due: a new stream takes time
        self._sent = 0
        check_it_fits(self._commands, wire)

    @property
    def following(self) -> TimedCommand | None:
        """The next command, not yet corrected; None when all are sent."""
        if self._sent == len(self._commands):
            self._commands.extend(islice(self._rest, 1))
        return self._commands[self._sent] if self._sent < len(self._commands) else None

    def next(self) -> TimedCommand | None:
        """Return the next command, computed again if necessary; None when all are sent."""
        self._correct()
        return self.following

    def begin_s(self, wire: Wire, latched: MotionCommand | None) -> float | None:
        """Return when the lines of the next command have to begin, without lead; None when all are sent."""
        timed = self.following
        return None if timed is None else timed.time_s - exchanges_s(wire, timed.command, latched) - wire.latency_s

    def sent(self, timed: TimedCommand, late_s: float) -> None:
        """Record that the next command was sent, and its delay."""
        super().sent(timed, late_s)
        self._sent += 1

    def _correct(self) -> None:
        timed = self.following
        if self.running is None or timed is None:
            return
        self.moved_by_drift()
        running = self.running
        start = running.reference_at(timed.time_s)
        slip_deg = start.angle_deg - timed.expected.angle_deg
        if abs(slip_deg) > _SLIP_DEG:
            self.corrections.append(Correction(timed.time_s, slip_deg))
            self._rest = self._streaming.commands_after(running, self._sent, timed.time_s)
            del self._commands[self._sent :]


class _Drift:
    """The mean deviation of the readings from their prediction, with the largest weight on the latest."""

    def __init__(self, filter_s: float) -> None:
        self._filter_s = filter_s
        self.forget()

    def forget(self) -> None:
        """Start again."""
        self.estimate_deg = 0.0
        self._last_s: float | None = None

    def take(self, time_s: float, difference_deg: float) -> None:
        """Add one deviation."""
        if self._last_s is not None:
            share = min(1.0, (time_s - self._last_s) / self._filter_s)
            self.estimate_deg += share * (difference_deg - self.estimate_deg)
        self._last_s = time_s
