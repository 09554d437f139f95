"""The whole motion that the table has to make for a plan, in time: run-up, scan steps, pauses, and the stop.

Time 0 is the first scan location. A plan that starts in motion needs a run-up before it; one that ends in motion
passes the last location, brakes and comes back to it.
"""

import math
from bisect import bisect_right
from collections.abc import Iterator
from enum import StrEnum
from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np

from planner.arrays import FloatArray
from planner.planning.plan import Pause, Plan
from planner.table.motion import Limits
from protocol.trapezoid import MotionCommand, ReferenceState, advance, move, time_to_rest_s

# What the drive needs after its profile has ended, until the table stands.
_SETTLING_S = 0.3


class Phase(StrEnum):
    """What goes on while the table makes a leg."""

    RUN_UP = "run-up"
    SCAN = "scan"
    WAIT = "wait"
    RETRACT = "retract"
    ROTATE = "rotate"
    APPROACH = "approach"
    STOP = "stop"


class Leg(NamedTuple):
    """A part of the motion: constant acceleration, or where `command` is set what the profiler makes of it.

    Attributes:
        phase: what goes on.
        column: the scan location that it starts from.
        start_s: when.
        duration_s: how long.
        start: where, and how fast.
        acceleration_deg_s2: 0 where there is a command.
        command: a motion from here to rest at its target.
    """

    phase: Phase
    column: int
    start_s: float
    duration_s: float
    start: ReferenceState
    acceleration_deg_s2: float = 0.0
    command: MotionCommand | None = None

    @property
    def end_s(self) -> float:
        """When it ends."""
        return self.start_s + self.duration_s

    def state_at(self, time_s: float) -> ReferenceState:
        """Return the planned angle and speed at a time within the leg."""
        if self.command is not None:
            return advance(self.start, self.command, time_s - self.start_s)
        return move(self.start, self.acceleration_deg_s2, time_s - self.start_s)


class PauseTimes(NamedTuple):
    """How long the robot takes in a pause of the scan: to draw the probe back, to turn, and to bring the probe near.

    It turns while the table does, which may take longer.
    """

    retract_s: float = 1.0
    approach_s: float = 1.0
    rotate_s: float = 0.0


class MotionInTime(Protocol):
    """A motion as it is streamed, watched and judged: known whole, or as far as it is decided."""

    @property
    def start_deg(self) -> float:
        """Where the table has to stand, at rest, before the first leg."""

    @property
    def start_s(self) -> float:
        """When the first leg starts."""

    @property
    def end_s(self) -> float:
        """When the table stands at the end of what is known."""

    def leg_at(self, time_s: float) -> Leg:
        """Return the leg at a time."""

    def state_at(self, time_s: float) -> ReferenceState:
        """Return the planned angle and speed at a time."""

    def column_time_s(self, column: int) -> float:
        """Return when a scan location is reached; infinite where that is not known."""


class TableMotion:
    """The legs of a plan, one after the other.

    Attributes:
        plan: the plan.
        legs: what the table does, without gaps.
    """

    def __init__(self, plan: Plan, limits: Limits, pause_times: PauseTimes | None = None) -> None:
        """Lay out the motion of `plan`; pauses, run-up and stop use the limits."""
        self.plan = plan
        self.legs = tuple(_legs(plan, limits, pause_times or PauseTimes()))
        self._starts = [leg.start_s for leg in self.legs]

    @property
    def start_deg(self) -> float:
        """Where the table has to stand, at rest, before the first leg."""
        return self.legs[0].start.angle_deg

    @property
    def start_s(self) -> float:
        """When the first leg starts: 0, or before that by the run-up."""
        return self.legs[0].start_s

    @property
    def end_s(self) -> float:
        """When the table stands at the last location."""
        return self.legs[-1].end_s

    @cached_property
    def column_times_s(self) -> FloatArray:
        """(n + 1,) when each scan location is reached."""
        times = np.zeros(len(self.plan.angles_deg))
        for leg in self.legs:
            if leg.phase in {Phase.SCAN, Phase.APPROACH}:
                times[leg.column + 1] = leg.end_s
        return times

    def column_time_s(self, column: int) -> float:
        """Return when a scan location is reached; infinite beyond the last."""
        return float(self.column_times_s[column]) if column < len(self.column_times_s) else math.inf

    def leg_at(self, time_s: float) -> Leg:
        """Return the leg at a time; the first one before it all, the last one after."""
        return self.legs[max(0, bisect_right(self._starts, time_s) - 1)]

    def state_at(self, time_s: float) -> ReferenceState:
        """Return the planned angle and speed at a time: at rest before the first leg and after the last."""
        return self.leg_at(time_s).state_at(max(time_s, self.start_s))

    def angles_at(self, times_s: FloatArray) -> FloatArray:
        """Return the planned angles at the given times."""
        return np.array([self.state_at(float(time)).angle_deg for time in times_s])


def _legs(plan: Plan, limits: Limits, pause_times: PauseTimes) -> Iterator[Leg]:
    rate = limits.acceleration_deg_s2
    state = ReferenceState(float(plan.angles_deg[0]), float(plan.speeds_deg_s[0]))
    if state.speed_deg_s != 0.0:
        yield _run_up(state, rate)
    time_s, paused = 0.0, {pause.step: pause for pause in plan.pauses}
    waits_s = {wait.location: wait.duration_s for wait in plan.waits}
    for k, acceleration in enumerate(plan.accelerations_deg_s2):
        state = ReferenceState(float(plan.angles_deg[k]), float(plan.speeds_deg_s[k]))
        if k in waits_s:
            yield Leg(Phase.WAIT, k, time_s, waits_s[k], state)
            time_s += waits_s[k]
        if k in paused:
            for leg in pause_legs(paused[k], time_s, state, limits, pause_times):
                yield leg
                time_s = leg.end_s
        else:
            yield Leg(Phase.SCAN, k, time_s, plan.step_s, state, float(acceleration))
            time_s += plan.step_s
    end = ReferenceState(float(plan.angles_deg[-1]), float(plan.speeds_deg_s[-1]))
    last = len(plan.accelerations_deg_s2)
    if last in waits_s:
        yield Leg(Phase.WAIT, last, time_s, waits_s[last], end)
        time_s += waits_s[last]
    yield stop_leg(last, time_s, end, limits)


def stop_leg(column: int, time_s: float, end: ReferenceState, limits: Limits) -> Leg:
    """Return the leg that ends a motion at rest at its last angle."""
    back = MotionCommand(end.angle_deg, *limits)
    return Leg(Phase.STOP, column, time_s, time_to_rest_s(end, back) + _SETTLING_S, end, command=back)


def _run_up(reached: ReferenceState, rate_deg_s2: float) -> Leg:
    """Return the leg from rest that ends in a state at time 0."""
    acceleration = rate_deg_s2 if reached.speed_deg_s > 0.0 else -rate_deg_s2
    duration_s = reached.speed_deg_s / acceleration
    angle = reached.angle_deg - 0.5 * reached.speed_deg_s * duration_s
    return Leg(Phase.RUN_UP, 0, -duration_s, duration_s, ReferenceState(angle, 0.0), acceleration)


def pause_legs(
    pause: Pause, time_s: float, state: ReferenceState, limits: Limits, pause_times: PauseTimes
) -> Iterator[Leg]:
    """Yield the legs of a pause: the table comes to rest while the probe retracts, turns, and waits for the probe."""
    speed, rate = limits
    stand = MotionCommand(pause.from_angle_deg, speed, rate)
    turn = MotionCommand(pause.to_angle_deg, speed, rate)
    approach = MotionCommand(pause.to_angle_deg, speed, rate)
    for phase, command, least_s in (
        (Phase.RETRACT, stand, pause_times.retract_s),
        (Phase.ROTATE, turn, pause_times.rotate_s),
        (Phase.APPROACH, approach, pause_times.approach_s),
    ):
        duration_s = max(least_s, time_to_rest_s(state, command) + _SETTLING_S)
        yield Leg(phase, pause.step, time_s, duration_s, state, command=command)
        time_s, state = time_s + duration_s, ReferenceState(command.target_deg, 0.0)
