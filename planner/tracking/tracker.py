"""Track a path that becomes known while the table moves: locations and time go in, commands and joint targets come out.

No I/O and no clock. `python -m planner track` and other programs call `reveal` when a location arrives, and `next` when
`begin_s` has come. They send the returned command at its time, and report it with `sent`. The commands are encoded as
in `python -m planner run`: each from the predicted reference, corrected by the readings of the encoder.
"""

from collections import deque
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from planner.arrays import CodeArray, FloatArray
from planner.defaults import LAG_S, LEAD_S, RECEDING, RUN_ON_DEG
from planner.errors import PlannerError
from planner.execution.pieces import pieces_of_leg, spacing_s
from planner.execution.run_record import Correction
from planner.execution.stream import Encoder, TimedCommand, standing_at
from planner.execution.stream_correction import FollowedReference
from planner.execution.table_motion import Leg, PauseTimes, Phase
from planner.kinematics.configuration import Configuration
from planner.map.column_rater import ColumnRater
from planner.map.config_map import DEFAULT_EPSILON
from planner.map.map_problem import MapProblem
from planner.table.cost import Weights
from planner.table.motion import Limits
from planner.table.wire import Grid, StreamError, Wire, exchanges_s
from planner.tracking.decision import METHODS, costs_of_starts
from planner.tracking.followed_arm import FollowedArm
from planner.tracking.growing_motion import GrowingMotion
from planner.tracking.online_planner import Blocked, Kind, OnlinePlanner, State, Step, Why, may_rest
from planner.tracking.revealed_map import RevealedMap, WindowError
from protocol.trapezoid import MotionCommand

DECISION_S = 0.01
"""From the moment at which a decision is asked for to that at which its lines begin."""
_READY_S = 0.005
"""A decision that begins later than so long before its lines is not taken."""
_RESUME_COLUMNS = 10
# A command that is so close to what was decided is as good as the closest one, and found sooner.
_CLOSE_DEG = 0.02


class TrackError(PlannerError):
    """A scan that cannot be tracked, or not any further. The table rests, or comes to rest."""


class TrackSettings(NamedTuple):
    """How a path is tracked.

    Attributes:
        planner: `receding` or `ray_shooting`.
        view: columns that are known ahead of the table at most.
        margin_deg: distance that the table keeps from what is forbidden.
        reconfigure: whether a pause may change the arm's configuration where the path goes on in no other way.
        pause_times: duration of the robot's actions in a pause.
        run_on_deg: maximum angle that the table may run on if the line fails.
        lag_s: see `planner.execution.execute.Settings`, as for the next three.
        lead_s: see there.
        drift_deg: see there.
        drift_filter_s: see there.
    """

    planner: str = RECEDING
    view: int = 50
    margin_deg: float = 0.1
    reconfigure: bool = False
    pause_times: PauseTimes = PauseTimes()
    run_on_deg: float = RUN_ON_DEG
    lag_s: float = LAG_S
    lead_s: float = LEAD_S
    drift_deg: float = 0.15
    drift_filter_s: float = 3.0


class Column(NamedTuple):
    """A location that became known.

    Attributes:
        location: its number.
        T_WS: (4, 4) where the probe must be.
        values: (n_angles,) f_R in the present configuration.
        reasons: (n_angles,) why an angle is forbidden.
    """

    location: int
    T_WS: FloatArray
    values: FloatArray
    reasons: CodeArray


class JointTarget(NamedTuple):
    """Where the arm is to be at a time; between two targets its joints move in proportion.

    Attributes:
        time_s: the time of the motion.
        location: the scan location.
        phase: what goes on from there.
        joints_deg: (6,) the robot's own angles.
    """

    time_s: float
    location: int
    phase: Phase
    joints_deg: FloatArray


class Start(NamedTuple):
    """Where a scan begins: at rest.

    Attributes:
        configuration: of the arm.
        angle_deg: of the table.
        joints: (6,) of the arm, in radians.
        column: the first location.
    """

    configuration: Configuration
    angle_deg: float
    joints: FloatArray
    column: Column


class Tracked(NamedTuple):
    """What `Tracker.next` returns.

    Attributes:
        command: what to send, so that it takes effect at its time.
        step: the step that was taken for it; None where the command belongs to the step before.
        targets: where the arm is to be in that step.
        recounted: after a change of configuration, the columns ahead in the new one.
        configuration: of the arm from the end of the step on.
    """

    command: TimedCommand
    step: Step | None
    targets: tuple[JointTarget, ...]
    recounted: tuple[Column, ...]
    configuration: Configuration


class _Known(NamedTuple):
    """A location in view: its pose and the arm's goal (4, 4)."""

    T_WS: FloatArray
    goal: FloatArray


class Tracker(FollowedReference):
    """One scan that is tracked. All times are those of the motion, 0 at the first location.

    Attributes:
        motion: what the table does, as far as it is decided.
        corrections: where the reference was moved to where the encoder reads it.
        missed: how many decisions were not ready in time.
        reconfigurations: how often the arm changed its configuration.
    """

    def __init__(
        self,
        problem: MapProblem,
        step_s: float,
        limits: Limits,
        weights: Weights | None = None,
        wire: Wire | None = None,
        settings: TrackSettings | None = None,
        configurations: Sequence[Configuration] = tuple(Configuration),
        angle_count: int = 360,
    ) -> None:
        """Start without a known location.

        Args:
            problem: the cell; its own locations do not count.
            step_s: time from one location to the next.
            limits: of the table.
            weights: of Eq. (5); None takes the default for the limits.
            wire: properties of the serial line.
            settings: how the path is tracked.
            configurations: those that the start is chosen among.
            angle_count: table angles of a column.

        Raises:
            StreamError: a step is too short for the commands of a step, or a limit is too small to be sent.
            TrackError: the planner is none that decides step by step.
        """
        self._settings, self._wire = settings or TrackSettings(), wire or Wire()
        super().__init__(
            self._settings.drift_deg, self._settings.drift_filter_s, self._settings.lag_s - self._settings.lead_s
        )
        if self._settings.planner not in METHODS:
            raise TrackError(f"the planner is {self._settings.planner}; allowed are {', '.join(METHODS)}")
        self._problem, self._step_s, self._limits, self._weights = problem, step_s, limits, weights
        # A table that brakes at its limit brakes at the A that can be sent.
        self._sent_limits = Grid(limits, self._wire).limits
        self._angle_count = angle_count
        self._times_of_lines: dict[float, tuple[float, float]] = {}
        self._check_the_step_fits()
        self._every = ColumnRater(problem, tuple(configurations), angle_count)
        self._rater = self._every
        self._known: deque[_Known] = deque()
        self._first_known, self._ended = 0, False
        self._pieces: deque[Leg] = deque()
        self._planner: OnlinePlanner | None = None
        self._fault: PlannerError | None = None
        self._is_over = False
        self.corrections: list[Correction] = []
        self._recounted: tuple[Column, ...] = ()
        self.missed, self.reconfigurations = 0, 0

    @property
    def count(self) -> int:
        """How many locations are known or were."""
        return self._first_known + len(self._known)

    @property
    def room(self) -> int:
        """How many locations may be revealed now: the window ends `view` columns ahead of the table."""
        if self._ended:
            return 0
        return self._settings.view + 1 - self.count if self._planner is None else self._planner.revealed.room

    @property
    def state(self) -> State:
        """The state at the end of what is decided."""
        return self._online.state

    @property
    def settings(self) -> TrackSettings:
        """How the path is tracked."""
        return self._settings

    def map_metadata(self, T_WS: FloatArray) -> Mapping[str, object]:
        """Return the metadata of a map of locations (n, 4, 4), without its configuration."""
        return self._rater.metadata(T_WS)

    @property
    def configuration(self) -> Configuration:
        """The arm's configuration."""
        return self._rater.configurations[0]

    def reveal(self, T_WS: FloatArray) -> Column | None:
        """Take the next location, (4, 4), and return its column; None before the start is chosen.

        Raises:
            WindowError: it is ahead of the window, or the path has ended.
        """
        if self.room < 1:
            where = "the path has ended" if self._ended else f"the window ends at location {self.count - 1}"
            raise WindowError(f"location {self.count} is not to be sent yet or any more: {where}")
        goals = self._every.goals(T_WS[np.newaxis])
        if self._planner is None:
            self._known.append(_Known(T_WS, goals[0]))
            return None
        values, reasons = self._rater.rate(goals, self.count)
        column = Column(self.count, T_WS, values[0, 0], reasons[0, 0])
        self._planner.revealed.reveal(column.values)
        self._known.append(_Known(T_WS, goals[0]))
        return column

    def end(self) -> None:
        """Record that no more locations come."""
        self._ended = True
        if self._planner is not None:
            self._planner.ended = True

    def abandon(self, fault: PlannerError) -> None:
        """Come to rest by the motion that is kept; `next` raises the fault when the table rests."""
        self._fault = self._fault or fault

    def choose_start(self) -> Start:
        """Return the best start in view: configuration and table angle.

        Raises:
            TrackError: there is none.
        """
        if self.count < 2:
            raise TrackError(f"the number of locations of the path is {self.count}; it must be at least 2")
        values, reasons = self._every.rate(np.stack([each.goal for each in self._known]), 0)
        starts = [self._start_in(c, values[c], reasons[c]) for c in range(len(values))]
        possible = [start for start in starts if start is not None]
        if not possible:
            reason = _most_frequent(self._every.metadata(self._known[0].T_WS[np.newaxis]), reasons[:, 0])
            raise TrackError(
                "location 0 has no table angle at which the arm may hold the probe, mostly because of"
                f" {reason}; begin the path elsewhere, or move the workpiece"
            )
        start = min(possible, key=lambda each: each[0])[1]
        return start._replace(joints=self._joints_to_begin_with(start))

    def begin(self, start: Start, turns: int = 0) -> tuple[Column, ...]:
        """Begin at a start, full turns of the table farther, and return the columns that are known."""
        self._rater = ColumnRater(self._problem, [start.configuration], self._angle_count)
        angle_deg = start.angle_deg + 360.0 * turns
        revealed, columns = self._revealed(self._rater, 0)
        view = self._settings.view
        self._planner = OnlinePlanner(
            revealed,
            METHODS[self._settings.planner](),
            State(0, angle_deg, 0.0, start.joints),
            self._settings.margin_deg,
            min(view, _RESUME_COLUMNS),
            self._arm(start.configuration),
            self._goals,
        )
        self._planner.ended = self._ended
        self._planner.rehearse()
        self.motion = GrowingMotion(angle_deg, self._step_s, self._limits, self._settings.pause_times)
        self._encoder = Encoder(
            self.motion,
            self._limits,
            self._wire,
            self._settings.run_on_deg,
            self._spacing_s(angle_deg),
            _CLOSE_DEG,
        )
        return columns

    def begin_s(
        self,
        wire: Wire | None = None,  # noqa: ARG002 - see `Commands`
        latched: MotionCommand | None = None,  # noqa: ARG002 - the same
    ) -> float | None:
        """Return when to ask for the next command, without lead; None when the table stops at the path's end."""
        if self._is_over:
            return None
        if self._pieces:
            return self._pieces[0].start_s - self._lines_s
        return self.motion.decided_s - self._lines_s - DECISION_S

    def next(self, now_s: float) -> Tracked | None:
        """Return the next command; None when all are sent.

        Args:
            now_s: the present time. A decision that would not be ready in time is not taken: the kept motion goes on.

        Raises:
            TrackError: the path is blocked; the table rests.
            PlannerError: the fault for which the scan was abandoned; the table rests.
        """
        if self._is_over:
            return None
        step: Step | None = None
        targets: tuple[JointTarget, ...] = ()
        if not self._pieces:
            step, legs = self._next_legs(now_s)
            spacing = self._spacing_s(self.motion.state_at(self.motion.decided_s).angle_deg)
            for leg in legs:
                self._pieces.extend(pieces_of_leg(leg, self._limits, spacing, self._settings.run_on_deg))
            targets = () if step is None else self._targets(step, legs)
        recounted, self._recounted = self._recounted, ()
        return Tracked(self._command(self._pieces.popleft()), step, targets, recounted, self.configuration)

    def _next_legs(self, now_s: float) -> tuple[Step | None, tuple[Leg, ...]]:
        """Take the next step, or stop where the path ends."""
        online = self._online
        if online.state.is_at_rest and self._fault is not None:
            raise self._fault
        if online.is_finished:
            self._is_over = True
            return None, (self.motion.stop(online.state),)
        is_in_time = now_s + _READY_S <= self.motion.decided_s - self._settings.lead_s - self._lines_s
        step = online.step(is_in_time and self._fault is None)
        if isinstance(step, Blocked):
            step = self._reconfigured(step)
        if step.why is Why.NOT_IN_TIME and self._fault is None:
            self.missed += 1
        self._forget_before(step.end.location)
        return step, self.motion.take(step)

    def _command(self, piece: Leg) -> TimedCommand:
        """Return the command of a piece, with a target that serves until the next one, however late that may be."""
        moved_deg = self.moved_by_drift()
        if moved_deg:
            self.corrections.append(Correction(piece.start_s, moved_deg))
        before = standing_at(self._encoder.start) if self.running is None else self.running.going_on_at
        choice = self._encoder.choice(self.running, before, piece)
        timed = TimedCommand(choice.time_s, piece, choice.command, before(choice.time_s))
        latest_s = piece.end_s + self._step_s - self._spacing_s(timed.expected.angle_deg)
        return self._encoder.aimed(timed, min(latest_s, self._encoder.next_by_s(timed)))

    def _targets(self, step: Step, legs: tuple[Leg, ...]) -> tuple[JointTarget, ...]:
        """Return the joints at the ends of a step's legs."""
        arm = self._arm(self.configuration)
        if step.end.joints is None or step.start.joints is None:
            return ()
        before, after = arm.robot_deg(step.start.joints), arm.robot_deg(step.end.joints)
        if step.kind is not Kind.PAUSE:
            return (JointTarget(legs[-1].end_s, step.end.location, Phase.SCAN, after),)
        retract, rotate, approach = legs[:3]
        return (
            JointTarget(retract.start_s, step.start.location, Phase.RETRACT, before),
            JointTarget(rotate.start_s, step.start.location, Phase.ROTATE, before),
            JointTarget(rotate.end_s, step.end.location, Phase.APPROACH, after),
            JointTarget(approach.end_s, step.end.location, Phase.SCAN, after),
        )

    def _reconfigured(self, blocked: Blocked) -> Step:
        """Go on in the best other configuration in a pause, where that is allowed.

        Raises:
            TrackError: it is not, or none serves.
        """
        online, goal = self._online, self._known[blocked.location - self._first_known]
        values, reasons = self._every.rate(goal.goal[np.newaxis], blocked.location)
        brightness = values.max(axis=(1, 2))
        others = [
            self._every.configurations[c]
            for c in np.argsort(-brightness, kind="stable")
            if brightness[c] > DEFAULT_EPSILON and self._every.configurations[c] is not self.configuration
        ]
        for configuration in others if self._settings.reconfigure else ():
            rater = ColumnRater(self._problem, [configuration], self._angle_count)
            revealed, columns = self._revealed(rater, self._first_known)
            online.change(revealed, self._arm(configuration))
            step = online.pause()
            if isinstance(step, Step):
                self._rater, self._recounted = rater, columns[1:]
                self.reconfigurations += 1
                return step
        own = self._every.configurations.index(self.configuration)
        reason = _most_frequent(self._rater.metadata(goal.T_WS[np.newaxis]), reasons[own])
        names = ", ".join(each.label for each in others)
        hint = f"{names} would serve; allow that with --reconfigure" if others else "no configuration serves"
        raise TrackError(
            f"location {blocked.location} has no table angle that is allowed in {self.configuration.label}, mostly"
            f" because of {reason}; {hint if not self._settings.reconfigure else 'no other configuration serves'}"
        )

    @property
    def _online(self) -> OnlinePlanner:
        if self._planner is None:
            raise TrackError("the scan has not begun; choose a start, then begin")
        return self._planner

    @property
    def _lines_s(self) -> float:
        """How long the lines of a command take, until its P takes effect."""
        return self._line_times(self.motion.start_deg)[0]

    def _spacing_s(self, angle_deg: float) -> float:
        """Return how long before the end of a step its command has to take effect at the latest."""
        return self._line_times(angle_deg)[1]

    def _line_times(self, angle_deg: float) -> tuple[float, float]:
        """Return both, which depend on the digits of the angle alone."""
        farthest_deg = 10.0 ** len(str(int(abs(angle_deg) + 1000.0))) - 1.0
        if farthest_deg not in self._times_of_lines:
            lines_s = exchanges_s(self._wire, MotionCommand(-farthest_deg, *self._limits)) + self._wire.latency_s
            between_s = spacing_s(farthest_deg - 1000.0, self._limits, self._wire) + DECISION_S
            self._times_of_lines[farthest_deg] = lines_s, between_s
        return self._times_of_lines[farthest_deg]

    def _check_the_step_fits(self) -> None:
        needed_s = self._spacing_s(0.0)
        fits_s = np.ceil(100.0 * needed_s) / 100.0
        if needed_s > self._step_s:
            raise StreamError(
                f"the commands of a step, and its decision, take {1000.0 * needed_s:.0f} ms at {self._wire.baud} baud,"
                f" and a step lasts {1000.0 * self._step_s:g} ms; a time step of {fits_s:g} s"
                " would fit"
            )

    def _arm(self, configuration: Configuration) -> FollowedArm:
        return FollowedArm(self._problem.cell, configuration, self._step_s)

    def _goals(self, first: int, last: int) -> FloatArray:
        begin = self._first_known
        return np.stack([self._known[k - begin].goal for k in range(first, last + 1)])

    def _forget_before(self, location: int) -> None:
        while self._first_known < location:
            self._known.popleft()
            self._first_known += 1

    def _revealed(self, rater: ColumnRater, first: int) -> tuple[RevealedMap, tuple[Column, ...]]:
        """Return the known columns in one configuration."""
        values, reasons = rater.rate(np.stack([each.goal for each in self._known]), first)
        revealed = RevealedMap(
            self._angle_count, self._step_s, self._sent_limits, self._weights, self._settings.view, first
        )
        for column in values[0]:
            revealed.reveal(column)
        columns = zip(self._known, values[0], reasons[0], strict=True)
        return revealed, tuple(Column(first + k, known.T_WS, v, r) for k, (known, v, r) in enumerate(columns))

    def _joints_to_begin_with(self, start: Start) -> FloatArray:
        """Return the joints at a start on the turns that serve longest on the way through the first view."""
        rater = ColumnRater(self._problem, [start.configuration], self._angle_count)
        preview = OnlinePlanner(
            self._revealed(rater, 0)[0],
            METHODS[self._settings.planner](),
            State(0, start.angle_deg, 0.0),
            self._settings.margin_deg,
            resume_columns=1,
        )
        preview.ended, states = True, [preview.state]
        while not preview.is_finished and isinstance(step := preview.step(), Step) and step.kind is Kind.SCAN:
            states.append(step.end)
        angles = np.array([state.angle_deg for state in states])
        joints = self._arm(start.configuration).begin(self._goals(0, len(states) - 1), angles)
        return start.joints if joints is None else joints

    def _start_in(self, c: int, values: FloatArray, reasons: CodeArray) -> tuple[float, Start] | None:
        """Return the cost of the best start in a configuration, and the start; None where there is none."""
        revealed = RevealedMap(self._angle_count, self._step_s, self._sent_limits, self._weights, self._settings.view)
        for column in values:
            revealed.reveal(column)
        window = revealed.window(0)
        costs, arm = costs_of_starts(revealed.online, window), self._arm(self._every.configurations[c])
        for sample in np.argsort(costs, kind="stable").tolist():
            angle_deg = sample * 360.0 / self._angle_count
            if not np.isfinite(costs[sample]):
                return None
            if not may_rest(window.terms, 0, angle_deg, self._settings.margin_deg):
                continue
            joints = arm.arrive(self._known[0].goal, angle_deg)
            if joints is not None:
                column = Column(0, self._known[0].T_WS, values[0], reasons[0])
                start = Start(self._every.configurations[c], angle_deg, joints, column)
                return float(costs[sample]), start
        return None


def _most_frequent(metadata: object, reasons: CodeArray) -> str:
    """Return in words the reason that most cells have."""
    assert isinstance(metadata, dict)
    code = int(np.bincount(reasons.ravel()).argmax())
    return str(metadata["reasons"].get(code, "another reason"))
