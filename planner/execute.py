"""Run a motion on the table at a port: send each command in time, read, correct, and stop when it goes wrong.

One code path for a pty, TCP, a serial device and simulated time: the clock comes from the port. Between two motion
commands the position is polled (H) and, at each scan location, the latch is read (L); neither delays a command. The
record of what was sent and seen is complete whatever happens.
"""

from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import NamedTuple

import numpy as np

from planner.closest_command import latest_s
from planner.errors import PlannerError
from planner.inside_view import InsideView
from planner.motion import Limits
from planner.run_record import Correction, Observation, Record, Sent
from planner.stream import TimedCommand, check_it_fits, stream
from planner.table_motion import TableMotion
from planner.velocity_profile import MotionCommand, ReferenceState, advance, time_to_rest_s
from planner.wire import Grid, Wire, command_line, exchanges_s
from protocol import ArrivalTimeout, CommandRefused, TableClient, TableError, Verb

# What the bytes of H and of its answer come to.
_READING_BYTES = 12
# A table at rest is within this of its target: 0.05 deg, and the rounding of its answer.
_AT_REST_DEG = 0.15
# A reference farther than this from where the stream had it is worth a new stream.
_SLIP_DEG = 0.03
# What took longer than this has no certain time: the operating system was busy elsewhere.
_CERTAIN_S = 0.01
# Between the last poll and the next command: what the operating system may take.
_SLACK_S = 0.005


class ExecutionError(TableError):
    """The table cannot do what the plan asks."""


class StrayedError(ExecutionError):
    """The table is not where the plan wants it."""


class Settings(NamedTuple):
    """How a motion is run.

    Attributes:
        lag_s: how long after the reference the encoder is at the same angle; the default is that of the stand-in's
            speed loop.
        lead_s: how long before their time the commands take effect. With the lag, the encoder is in time; with 0, the
            reference is.
        tolerance_deg: how far the encoder may be from the plan before the table is stopped.
        drift_deg: how far the reference may be from where it was expected before the rest is streamed anew.
        drift_filter_s: over how long readings are averaged for that.
        poll_s: from one reading of the position to the next, at least.
        look_s: the same for looks from inside.
    """

    lag_s: float = 0.0035
    lead_s: float = 0.0
    tolerance_deg: float = 1.0
    drift_deg: float = 0.15
    drift_filter_s: float = 3.0
    poll_s: float = 0.05
    look_s: float = 0.02


def execute(
    table: TableClient,
    motion: TableMotion,
    limits: Limits,
    wire: Wire,
    settings: Settings | None = None,
    view: InsideView | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Record:
    """Run a motion on a table that stands at its start, and return what happened.

    Whatever goes wrong, and Ctrl-C, stops the table and is named in the record.

    Args:
        table: the client at the table's port.
        motion: what the table should do.
        limits: greatest S and A.
        wire: what its commands have to pass.
        settings: how it is run.
        view: a way to look into the table, where there is one; then it also gets its triggers from here.
        progress: called with the time of the motion and its end, in ms.

    Raises:
        StreamError: the commands follow one another faster than the wire carries them; nothing was sent.
    """
    commands = stream(motion, limits, wire)
    check_it_fits(commands, wire)
    run = _Run(table, motion, limits, wire, settings or Settings(), view, progress)
    is_done = False
    try:
        run.go(commands)
        is_done = True
    except (TableError, PlannerError) as error:
        run.record.failure = str(error)
        run.record.has_strayed = isinstance(error, StrayedError | ArrivalTimeout)
    except KeyboardInterrupt:
        run.record.failure = "interrupted"
    finally:
        if not is_done:
            with suppress(TableError):
                table.stop()
        if progress is not None:
            progress(1, 1)
    return run.record


def bring_to(table: TableClient, angle_deg: float, limits: Limits, wire: Wire, tolerance_deg: float = 0.1) -> None:
    """Move the table to an angle at the limits, and wait until it stands there.

    Raises:
        TableError: the table did not get there; it was stopped.
    """
    way = Grid(limits, wire).command(MotionCommand(angle_deg, *limits))
    needed_s = time_to_rest_s(ReferenceState(table.position_deg(), 0.0), way)
    try:
        table.set_speed(way.speed_deg_s)
        table.set_acceleration(way.acceleration_deg_s2)
    except CommandRefused as error:
        raise ExecutionError(
            f"this table refuses the plan's limits, {limits.speed_deg_s:g} deg/s and"
            f" {limits.acceleration_deg_s2:g} deg/s2; plan within this table's own limits"
        ) from error
    try:
        table.move_to(way.target_deg)
        table.wait_until_at(way.target_deg, tolerance_deg, 2.0 * needed_s + 3.0)
    except (TableError, KeyboardInterrupt):
        with suppress(TableError):
            table.stop()
        raise


class _Run:
    """One motion under way. Times are those of the motion."""

    def __init__(
        self,
        table: TableClient,
        motion: TableMotion,
        limits: Limits,
        wire: Wire,
        settings: Settings,
        view: InsideView | None,
        progress: Callable[[int, int], None] | None,
    ) -> None:
        self._table, self._motion, self._limits, self._wire = table, motion, limits, wire
        self._settings, self._view, self._progress = settings, view, progress
        self._pending_columns = list(enumerate(motion.column_times_s))
        self._drift = _Drift(settings.drift_filter_s)
        self._latched: MotionCommand | None = None
        self._running: TimedCommand | None = None
        self._next_poll_s = self._next_look_s = motion.start_s
        # The first command's S and A are to be sent in peace.
        origin_s = table.clock.now_s() - motion.start_s + settings.lead_s + 4.0 * exchanges_s(wire, _ANY) + 0.1
        self.record = Record(origin_s=origin_s)

    def go(self, commands: Sequence[TimedCommand]) -> None:
        """Send all commands in their time, then wait until the table stands."""
        for number in range(len(commands)):
            commands = self._corrected(commands, number)
            self._send(commands[number])
            following = commands[number + 1] if number + 1 < len(commands) else None
            until_s = self._motion.end_s if following is None else self._prepare_s(following)
            self._observe(until_s)
        end_deg = self._running.command.target_deg if self._running else self._motion.start_deg
        position_deg = self._table.wait_until_at(end_deg, _AT_REST_DEG, timeout_s=3.0)
        self._see(Observation(self._now_s(), "H", position_deg))

    def _corrected(self, commands: Sequence[TimedCommand], number: int) -> Sequence[TimedCommand]:
        """Return the commands, computed anew from `number` on if the reference will not be where it was expected."""
        running, timed = self._running, commands[number]
        if running is None:
            return commands
        if abs(self._drift.estimate_deg) > self._settings.drift_deg:
            there = running.expected
            moved = ReferenceState(there.angle_deg + self._drift.estimate_deg, there.speed_deg_s)
            self._running = running = running._replace(expected=moved)
            self._drift.forget()
        start = advance(running.expected, running.command, timed.time_s - running.time_s)
        slip_deg = start.angle_deg - timed.expected.angle_deg
        if abs(slip_deg) <= _SLIP_DEG:
            return commands
        self.record.corrections.append(Correction(timed.time_s, slip_deg))
        return (*commands[:number], *stream(self._motion, self._limits, self._wire, number, start))

    def _send(self, timed: TimedCommand) -> None:
        """Send A and S where they change, and P so that its CR arrives in time."""
        command, before = timed.command, self._latched
        if before is None or command.acceleration_deg_s2 != before.acceleration_deg_s2:
            self._table.set_acceleration(command.acceleration_deg_s2)
        if before is None or command.speed_deg_s != before.speed_deg_s:
            self._table.set_speed(command.speed_deg_s)
        self._latched = command
        line = command_line(Verb.MOVE_TO, command.target_deg, self._wire)
        under_way_s = self._wire.seconds(len(line)) + self._wire.latency_s
        due_s = timed.time_s - self._settings.lead_s - under_way_s
        self._sleep_until(due_s)
        late_s = self._now_s() - due_s
        allowed_s = latest_s(timed.leg.duration_s if self._running is None else self._running.leg.duration_s)
        if late_s > allowed_s:
            raise ExecutionError(
                f"the command of location {timed.leg.column} would have come {late_s:.2f} s late, more than"
                f" {allowed_s:g} s: the table or this machine answers too slowly"
            )
        self._table.move_to(command.target_deg)
        self._running = self._as_sent(timed, max(0.0, late_s))
        self.record.sent.append(Sent(timed.time_s, late_s, timed.leg.phase, timed.leg.column, command))

    def _as_sent(self, timed: TimedCommand, late_s: float) -> TimedCommand:
        """Return the command with the moment at which it took effect, and where the reference then was."""
        if self._running is None:
            return timed._replace(time_s=timed.time_s + late_s)
        time_s = timed.time_s + late_s
        there = advance(self._running.expected, self._running.command, time_s - self._running.time_s)
        return timed._replace(time_s=time_s, expected=there)

    def _prepare_s(self, timed: TimedCommand) -> float:
        """Return when the lines of a command have to begin."""
        needed_s = exchanges_s(self._wire, timed.command, self._latched) + self._wire.latency_s + _SLACK_S
        return timed.time_s - self._settings.lead_s - needed_s

    def _observe(self, until_s: float) -> None:
        """Read latch and position, as often as there is time for it; then sleep."""
        reading_s = self._wire.seconds(_READING_BYTES) + self._wire.turnaround_s
        while True:
            column_s = float(self._pending_columns[0][1]) if self._pending_columns else float("inf")
            poll_s = max(self._now_s(), self._next_poll_s)
            is_trigger = poll_s + reading_s > column_s
            begin_s = column_s if is_trigger else poll_s
            if begin_s + reading_s > until_s:
                break
            self._sleep_until(begin_s)
            if is_trigger:
                self._latch()
            else:
                self._poll()
        self._sleep_until(until_s)

    def _latch(self) -> None:
        """Pull the trigger where it is ours to pull, and read the latch."""
        column, column_s = self._pending_columns.pop(0)
        time_s = float(column_s)  # a real probe pulled it then
        if self._view is not None:
            time_s = self._now_s()
            self._view.trigger()
            self._look(column)
        self._see(Observation(time_s, "L", self._table.latched_deg(), column))

    def _poll(self) -> None:
        """Read the position, and stop the run where it is not that of the plan."""
        self._next_poll_s = self._now_s() + self._settings.poll_s
        time_s = self._now_s() + self._wire.seconds(2)
        position_deg = self._table.position_deg()
        # The table looked at its encoder at some time from here to there: mostly here, when the answer is in time.
        answered_s = self._now_s() - self._wire.seconds(_READING_BYTES - 2)
        is_certain = answered_s - time_s < _CERTAIN_S
        self._see(Observation(time_s, "H" if is_certain else "H late", position_deg))
        self._check(position_deg, time_s, max(time_s, answered_s))
        assert self._running is not None
        # Where the reference was a lag ago, there the encoder is now.
        since_s = time_s + self._settings.lead_s - self._settings.lag_s - self._running.time_s
        if is_certain and since_s >= 0.0:
            expected = advance(self._running.expected, self._running.command, since_s)
            self._drift.take(time_s, position_deg - expected.angle_deg)

    def _check(self, position_deg: float, sent_s: float, answered_s: float) -> None:
        """Stop the run where the position is not what the plan has from one time to another."""
        planned_deg = [self._motion.state_at(time_s).angle_deg for time_s in np.linspace(sent_s, answered_s, 5)]
        off_deg = max(min(planned_deg) - position_deg, position_deg - max(planned_deg))
        if off_deg > self._settings.tolerance_deg:
            raise StrayedError(
                f"at {sent_s:.2f} s the table is at {position_deg:.1f} deg and should be at {planned_deg[0]:.1f},"
                f" more than {self._settings.tolerance_deg:g} deg off; does it turn freely?"
            )

    def _see(self, observation: Observation) -> None:
        self.record.observations.append(observation)
        if self._progress is not None:
            self._progress(round(1000.0 * observation.time_s), round(1000.0 * self._motion.end_s))

    def _look(self, column: int | None = None) -> None:
        assert self._view is not None
        begin_s = self._now_s()
        look = self._view.look()
        end_s = self._now_s()
        self._next_look_s = end_s + self._settings.look_s
        if column is not None or end_s - begin_s < _CERTAIN_S:
            time_s = 0.5 * (begin_s + end_s)
            self.record.observations.append(
                Observation(time_s, "inside", look.encoder_deg, column, look.reference_deg, look.true_deg)
            )

    def _now_s(self) -> float:
        return self._table.clock.now_s() - self.record.origin_s

    def _sleep_until(self, time_s: float) -> None:
        """Sleep, and look inside meanwhile where that is possible."""
        while (left_s := time_s - self._now_s()) > 0.0:
            if self._view is None:
                self._table.clock.sleep_s(left_s)
                continue
            look_in_s = self._next_look_s - self._now_s()
            if look_in_s <= 0.0:
                self._look()
            else:
                self._table.clock.sleep_s(min(left_s, look_in_s))


_ANY = MotionCommand(-100.0, 10.0, 10.0)


class _Drift:
    """The mean of what the readings differ from what was expected, the latest counting most."""

    def __init__(self, filter_s: float) -> None:
        self._filter_s = filter_s
        self.forget()

    def forget(self) -> None:
        """Begin anew."""
        self.estimate_deg = 0.0
        self._last_s: float | None = None

    def take(self, time_s: float, difference_deg: float) -> None:
        """Take in one difference."""
        if self._last_s is not None:
            share = min(1.0, (time_s - self._last_s) / self._filter_s)
            self.estimate_deg += share * (difference_deg - self.estimate_deg)
        self._last_s = time_s
