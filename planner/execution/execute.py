"""Run a motion on the table at a port: send each command in time, and stop the table when something goes wrong.

One code path for a pty, TCP, a serial device and simulated time: the clock comes from the port. What is sent is
`stream_correction`'s, what is seen between two commands `table_watch`'s. The record of both is complete whatever
happens.
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
from protocol.interrupts import signals_wait
from protocol.progress import Progress
from protocol.trapezoid import MotionCommand, ReferenceState, time_to_rest_s

# Between the last reading and the next command: what the operating system may take.
_SLACK_S = 0.005
# From the call to the first command, beside what its lines take.
_PREPARATION_S = 0.1
# A table that rests shows so within this time, however late it answers.
_RESTING_S = 3.0
# As long as any command: what its lines take at most.
_ANY_COMMAND = MotionCommand(-100.0, 10.0, 10.0)


class ExecutionError(TableError):
    """The table cannot do what the plan asks."""


class Settings(NamedTuple):
    """How a motion is run.

    Attributes:
        lag_s: how long after the reference the encoder is at the same angle; the default is that of the emulator's
            speed loop.
        lead_s: how long before their time the commands take effect. With the lag, the encoder is in time; with 0, the
            reference is.
        tolerance_deg: how far the encoder may be from the plan before the table is stopped.
        drift_deg: how far the reference may be from where it was expected before the rest is streamed anew.
        drift_filter_s: over how long readings are averaged for that.
        poll_s: from one reading of the position to the next, at least.
        look_s: the same for looks from inside.
        run_on_deg: how far the table may run on when the line dies.
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
        """How long after its time in the plan the encoder is at an angle."""
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
        """Return how late a command may be sent."""

    def sent(self, timed: TimedCommand, late_s: float) -> None:
        """Take note that the next command was sent, and how late."""

    def encoder_read(self, time_s: float, angle_deg: float) -> None:
        """Take note of where the encoder was at a time that is known for certain."""


def execute(
    table: TableClient,
    motion: TableMotion,
    limits: Limits,
    wire: Wire,
    settings: Settings | None = None,
    view: GroundTruth | None = None,
    progress: Progress | None = None,
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
        motion: what the table should do.
        commands: what to send.
        wire: what the commands have to pass.
        settings: how it is run.
        view: a way to look into the table, where there is one.
        progress: called with the time of the motion and its end, in ms.
        record: where to write what happens, if the caller wants to see it meanwhile.
    """
    # The first command's S and A are to be sent in peace.
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
    """Stop the table, and return in words how that went; a signal that comes meanwhile shows in the exit status."""
    report = ""
    with suppress(KeyboardInterrupt), signals_wait():
        report = table.stop_and_report()
    return report


def resting_deg(table: TableClient, wire: Wire) -> float:
    """Return where the table rests, before anything is sent that moves it.

    Raises:
        ExecutionError: it turns, so nobody knows by which way it would come to the start.
    """
    try:
        return table.wait_until_at(table.position_deg(), wire.quantum, _RESTING_S)
    except ArrivalTimeout as error:
        raise ExecutionError(
            f"the table is at {error.position_deg:g} deg and turns already; wait until it stands, then try again"
        ) from error


def bring_to(table: TableClient, angle_deg: float, limits: Limits, wire: Wire, tolerance_deg: float = 0.1) -> None:
    """Move the table to an angle at the limits, and wait until it stands there.

    Raises:
        TableError: the table did not get there; it was stopped, as after Ctrl-C.
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
    except TableError as error:
        raise ExecutionError(f"{error}; {_stopped(table)}") from error
    except KeyboardInterrupt as interrupt:
        interrupt.add_note(_stopped(table))
        raise


class _Run:
    """The commands of one motion under way, each sent so that it takes effect in time."""

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
        """Send all commands in their time, then wait until the table stands."""
        while (timed := self._commands.next()) is not None:
            self._send(timed)
            begin_s = self._commands.begin_s(self._wire, self._latched)
            until_s = motion.end_s if begin_s is None else begin_s - self._lead_s - _SLACK_S
            self._watch.read_until(until_s, self._commands.encoder_read)
        self._watch.wait_for_rest(self._latched.target_deg if self._latched else motion.start_deg)

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
                f" {allowed_s:g} s: the table or this machine answers too slowly"
            )
