"""Execute a motion on the table at a port: send each command in time, and stop the table on any failure.

The same code serves a pty, TCP, a serial device and simulated time: the clock is that of the port. `stream_correction`
provides the commands, and `table_watch` the readings between two commands. The record of both is complete in every
case.
"""

from contextlib import suppress
from typing import NamedTuple, Protocol

from planner.defaults import LAG_S, LEAD_S, RUN_ON_DEG
from planner.errors import PlannerError
from planner.execution.run_record import Correction, Record, Sent
from planner.execution.stream import TimedCommand
from planner.execution.stream_correction import CorrectedStream
from planner.execution.table_motion import MotionInTime, TableMotion
from planner.execution.table_watch import StrayedError, TableWatch
from planner.table.motion import Limits
from planner.table.wire import Grid, Wire, command_line, exchanges_s
from protocol import ArrivalTimeout, CommandRefused, TableClient, TableError, Verb
from protocol.bench import GroundTruth
from protocol.program.interrupts import signals_wait
from protocol.program.progress import Progress
from protocol.trapezoid import MotionCommand, ReferenceState, time_to_rest_s

# Margin between the last reading and the next command for delays of the operating system.
_SLACK_S = 0.005
# Time from the call to the first command, in addition to the transmission of its lines.
_PREPARATION_S = 0.1
# A resting table is detected within this time, even with slow replies.
_RESTING_S = 3.0
# Like any command: the maximum transmission time of its lines.
_ANY_COMMAND = MotionCommand(-100.0, 10.0, 10.0)


class ExecutionError(TableError):
    """The table cannot execute the plan."""


class Settings(NamedTuple):
    """Settings for the execution of a motion.

    Attributes:
        lag_s: delay of the encoder behind the reference. The default is the delay of the emulator's speed loop.
        lead_s: how early the commands take effect. With the value of the lag, the encoder is in time; with 0, the
            reference is in time.
        tolerance_deg: maximum deviation of the encoder from the plan; beyond it the table is stopped.
        drift_deg: maximum deviation of the reference from its prediction; beyond it the rest is streamed again.
        drift_filter_s: averaging time of the readings for this.
        poll_s: minimum time from one reading of the position to the next.
        look_s: the same for readings of the ground truth.
        run_on_deg: maximum angle that the table may run on if the line fails.
    """

    lag_s: float = LAG_S
    lead_s: float = LEAD_S
    tolerance_deg: float = 1.0
    drift_deg: float = 0.15
    drift_filter_s: float = 3.0
    poll_s: float = 0.05
    look_s: float = 0.02
    run_on_deg: float = RUN_ON_DEG

    @property
    def encoder_delay_s(self) -> float:
        """Delay from the time of an angle in the plan until the encoder has that angle."""
        return self.lag_s - self.lead_s


class Commands(Protocol):
    """The commands of a motion, one after the other: of a plan, or decided as they come due."""

    @property
    def corrections(self) -> list[Correction]:
        """Where the stream was changed for drift; the list grows while the motion runs."""

    def next(self) -> TimedCommand | None:
        """Return the next command; None when all are sent."""

    def begin_s(self, wire: Wire, latched: MotionCommand | None) -> float | None:
        """Return when the next command has to be asked for, without lead; None when all are sent."""

    def latest_s(self, timed: TimedCommand) -> float:
        """Return the maximum delay of a command."""

    def sent(self, timed: TimedCommand, late_s: float) -> None:
        """Record that the next command was sent, and its delay."""

    def encoder_read(self, time_s: float, angle_deg: float) -> None:
        """Record the position of the encoder at a time that is known exactly."""


def execute(
    table: TableClient,
    motion: TableMotion,
    limits: Limits,
    wire: Wire,
    settings: Settings | None = None,
    view: GroundTruth | None = None,
    progress: Progress | None = None,
) -> Record:
    """Execute a motion on a table that stands at its start, and return the record.

    Any failure, and Ctrl-C, stops the table and is named in the record.

    Args:
        table: the client at the table's port.
        motion: the planned motion of the table.
        limits: maximum S and A.
        wire: the properties of the serial line.
        settings: settings for the execution.
        view: access to the ground truth of the table, if there is one; then the triggers are sent through it too.
        progress: called with the time of the motion and its end, in ms.

    Raises:
        StreamError: the serial line is too slow for the commands; nothing was sent.
    """
    settings = settings or Settings()
    commands = CorrectedStream(
        motion,
        limits,
        wire,
        settings.drift_deg,
        settings.drift_filter_s,
        settings.encoder_delay_s,
        settings.run_on_deg,
    )
    return execute_commands(table, motion, commands, wire, settings, view, progress)


def execute_commands(
    table: TableClient,
    motion: MotionInTime,
    commands: Commands,
    wire: Wire,
    settings: Settings,
    view: GroundTruth | None = None,
    progress: Progress | None = None,
    record: Record | None = None,
) -> Record:
    """Send commands in their time and watch the motion that they make; see `execute`.

    Args:
        table: the client at the table's port.
        motion: the planned motion of the table.
        commands: the commands to send.
        wire: properties of the serial line.
        settings: settings for the execution.
        view: access to the ground truth of the table, if there is one.
        progress: called with the time of the motion and its end, in ms.
        record: the record to fill, for a caller that reads it during the motion.
    """
    # The S and A of the first command are sent without time pressure.
    preparation_s = 4.0 * exchanges_s(wire, _ANY_COMMAND)
    origin_s = table.clock.now_s() - motion.start_s + settings.lead_s + preparation_s + _PREPARATION_S
    record = record or Record()
    record.corrections, record.origin_s = commands.corrections, origin_s
    watch = TableWatch(
        table, motion, wire, record, settings.tolerance_deg, settings.poll_s, settings.look_s, view, progress
    )
    try:
        _Run(table, wire, commands, watch, record, settings.lead_s).go(motion)
    except BaseException as error:
        report = _stopped(table)
        reason = "interrupted" if isinstance(error, KeyboardInterrupt) else error
        record.failure = f"{reason}; {report}"
        record.has_strayed = isinstance(error, StrayedError | ArrivalTimeout)
        if not isinstance(error, TableError | PlannerError | KeyboardInterrupt):
            raise
    finally:
        if progress is not None:
            progress(1, 1)
    return record


def _stopped(table: TableClient) -> str:
    """Stop the table, and return the result as text. A signal received meanwhile affects the exit status."""
    report = ""
    with suppress(KeyboardInterrupt), signals_wait():
        report = table.stop_and_report()
    return report


def resting_deg(table: TableClient, wire: Wire) -> float:
    """Return the rest position of the table, before any command that moves it.

    Raises:
        ExecutionError: the table turns, so its path to the start is unknown.
    """
    try:
        return table.wait_until_at(table.position_deg(), wire.quantum, _RESTING_S)
    except ArrivalTimeout as error:
        raise ExecutionError(
            f"the table is at {error.position_deg:g} deg and is already turning; wait until it stands, then try again"
        ) from error


def bring_to(table: TableClient, angle_deg: float, limits: Limits, wire: Wire, tolerance_deg: float = 0.1) -> None:
    """Move the table to an angle at the limits, and wait until it stands there.

    Raises:
        TableError: the table did not arrive; it was stopped, as after Ctrl-C.
    """
    way = Grid(limits, wire).command(MotionCommand(angle_deg, *limits))
    needed_s = time_to_rest_s(ReferenceState(table.position_deg(), 0.0), way)
    try:
        table.set_speed(way.speed_deg_s)
        table.set_acceleration(way.acceleration_deg_s2)
    except CommandRefused as error:
        raise ExecutionError(
            f"the table refuses the limits of the plan, {limits.speed_deg_s:g} deg/s and"
            f" {limits.acceleration_deg_s2:g} deg/s2; create a plan within the limits of the table"
        ) from error
    try:
        table.move_to(way.target_deg)
        table.wait_until_at(way.target_deg, tolerance_deg, 2.0 * needed_s + 3.0)
    except TableError as error:
        raise ExecutionError(f"{error}; {_stopped(table)}") from error
    except KeyboardInterrupt as interrupt:
        interrupt.add_note(_stopped(table))
        raise


class _Run:
    """The commands of one running motion. Each is sent so that it takes effect in time."""

    def __init__(
        self,
        table: TableClient,
        wire: Wire,
        commands: Commands,
        watch: TableWatch,
        record: Record,
        lead_s: float,
    ) -> None:
        self._table, self._wire, self._commands = table, wire, commands
        self._watch, self._record, self._lead_s = watch, record, lead_s
        self._latched: MotionCommand | None = None

    def go(self, motion: MotionInTime) -> None:
        """Send all commands at their times, then wait until the table stands."""
        while (timed := self._commands.next()) is not None:
            self._send(timed)
            begin_s = self._commands.begin_s(self._wire, self._latched)
            until_s = motion.end_s if begin_s is None else begin_s - self._lead_s - _SLACK_S
            self._watch.read_until(until_s, self._commands.encoder_read)
        self._watch.wait_for_rest(self._latched.target_deg if self._latched else motion.start_deg)

    def _send(self, timed: TimedCommand) -> None:
        """Send A and S if they change, and P so that its CR arrives in time."""
        command, before = timed.command, self._latched
        if before is None or command.acceleration_deg_s2 != before.acceleration_deg_s2:
            self._table.set_acceleration(command.acceleration_deg_s2)
        if before is None or command.speed_deg_s != before.speed_deg_s:
            self._table.set_speed(command.speed_deg_s)
        self._latched = command
        line = command_line(Verb.MOVE_TO, command.target_deg, self._wire)
        under_way_s = self._wire.seconds(len(line)) + self._wire.latency_s
        due_s = timed.time_s - self._lead_s - under_way_s
        self._watch.sleep_until(due_s)
        late_s = self._watch.now_s() - due_s
        self._check_lateness(timed, late_s)
        self._table.move_to(command.target_deg)
        self._commands.sent(timed, late_s)
        self._record.sent.append(Sent(timed.time_s, late_s, timed.leg.phase, timed.leg.column, command))

    def _check_lateness(self, timed: TimedCommand, late_s: float) -> None:
        allowed_s = self._commands.latest_s(timed)
        if late_s > allowed_s:
            raise ExecutionError(
                f"the command of location {timed.leg.column} would have come {late_s:.2f} s late, more than"
                f" {allowed_s:g} s: the table or this machine is too slow"
            )
