"""The whole motion of the table for a plan, over time: run-up, scan steps, pauses, and stop.

Time 0 is the first scan location. A plan that starts in motion needs a run-up. For a plan that ends in motion, the
table passes the last location, brakes and returns to it.
"""

import math
from bisect import bisect_right
from collections.abc import Iterator
from enum import StrEnum
from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np

from planner.arrays import FloatArray
from planner.plans.plan import Pause, Plan
from planner.table.motion import Limits
from protocol.trapezoid import MotionCommand, ReferenceState, advance, move, time_to_rest_s

# Time from the end of the profile until the table stands.
_SETTLING_S = 0.3


class Phase(StrEnum):
    """The phase of the table's motion in a leg."""

    RUN_UP = "run-up"
    SCAN = "scan"
    WAIT = "wait"
    RETRACT = "retract"
    ROTATE = "rotate"
    APPROACH = "approach"
    STOP = "stop"


class Leg(NamedTuple):
    """A part of the motion: with constant acceleration, or with the controller's profile if `command` is set.

    Attributes:
        phase: the phase of the motion.
        column: the scan location at its start.
        start_s: its start.
        duration_s: its duration.
        start: angle and speed at its start.
        acceleration_deg_s2: 0 for a leg with a command.
        command: a motion from the start to rest at its target.
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
        """The end of the leg."""
        return self.start_s + self.duration_s

    def state_at(self, time_s: float) -> ReferenceState:
        """Return the planned angle and speed at a time within the leg."""
        if self.command is not None:
            return advance(self.start, self.command, time_s - self.start_s)
        return move(self.start, self.acceleration_deg_s2, time_s - self.start_s)


class PauseTimes(NamedTuple):
    """Duration of the robot's actions in a pause of the scan: retract the probe, turn, and return the probe.

    The robot turns while the table does, which may take longer.
    """

    retract_s: float = 1.0
    approach_s: float = 1.0
    rotate_s: float = 0.0


class MotionInTime(Protocol):
    """A motion as it is streamed, watched and judged: known whole, or as far as it is decided."""

    @property
    def start_deg(self) -> float:
        """The rest position of the table before the first leg."""

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
    """The legs of a plan, in order.

    Attributes:
        plan: the plan.
        legs: the legs of the table, without gaps.
    """

    def __init__(self, plan: Plan, limits: Limits, pause_times: PauseTimes | None = None) -> None:
        """Create the motion of `plan`; pauses, run-up and stop use the limits."""
        self.plan = plan
        self.legs = tuple(_legs(plan, limits, pause_times or PauseTimes()))
        self._starts = [leg.start_s for leg in self.legs]

    @property
    def start_deg(self) -> float:
        """The rest position of the table before the first leg."""
        return self.legs[0].start.angle_deg

    @property
    def start_s(self) -> float:
        """The start of the first leg: 0, or earlier by the run-up."""
        return self.legs[0].start_s

    @property
    def end_s(self) -> float:
        """The time at which the table stands at the last location."""
        return self.legs[-1].end_s

    @cached_property
    def column_times_s(self) -> FloatArray:
        """(n + 1,) the time of each scan location."""
        times = np.zeros(len(self.plan.angles_deg))
        for leg in self.legs:
            if leg.phase in {Phase.SCAN, Phase.APPROACH}:
                times[leg.column + 1] = leg.end_s
        return times

    def column_time_s(self, column: int) -> float:
        """Return when a scan location is reached; infinite beyond the last."""
        return float(self.column_times_s[column]) if column < len(self.column_times_s) else math.inf

    def leg_at(self, time_s: float) -> Leg:
        """Return the leg at a time; before and after the motion, the first and the last one."""
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
            yield wait_leg(k, time_s, waits_s[k], state, limits)
            time_s, state = time_s + waits_s[k], ReferenceState(state.angle_deg, 0.0)
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
        yield wait_leg(last, time_s, waits_s[last], end, limits)
        time_s, end = time_s + waits_s[last], ReferenceState(end.angle_deg, 0.0)
    yield stop_leg(last, time_s, end, limits)


def wait_leg(column: int, time_s: float, duration_s: float, start: ReferenceState, limits: Limits) -> Leg:
    """Return the leg of a wait: at rest, or from a motion to rest at the angle where it begins."""
    command = None if start.speed_deg_s == 0.0 else MotionCommand(start.angle_deg, *limits)
    return Leg(Phase.WAIT, column, time_s, duration_s, start, command=command)


def halt_s(start: ReferenceState, limits: Limits) -> float:
    """Return how long the table needs to come to rest at the angle where it is in motion."""
    return time_to_rest_s(start, MotionCommand(start.angle_deg, *limits)) + _SETTLING_S


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
    """Yield the legs of a pause: the table stops while the probe retracts, turns, and waits for the probe."""
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
