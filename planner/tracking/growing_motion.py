"""The motion of a table as far as it is decided, and after that the motion to rest that is kept; in flat memory."""

import math
from collections import deque
from collections.abc import Iterable

from planner.execution.table_motion import Leg, PauseTimes, Phase, halt_s, pause_legs, stop_leg, wait_leg
from planner.plans.plan import Pause
from planner.table.motion import Limits
from planner.tracking.online_planner import Kind, State, Step
from protocol.trapezoid import ReferenceState

# What lies so far back is forgotten: nobody streams or watches it any more.
_REMEMBERED_S = 10.0
_ROUNDING_S = 1e-9


class GrowingMotion:
    """The legs of a motion that is being decided; each step begins at a whole number of time steps.

    Attributes:
        start_deg: where the table rests at time 0.
        start_s: 0.
        ticks: the number of time steps that are decided.
    """

    start_s = 0.0

    def __init__(self, start_deg: float, step_s: float, limits: Limits, pause_times: PauseTimes) -> None:
        """Begin at rest; pauses and the stop use the limits."""
        self.start_deg, self.ticks = start_deg, 0
        self._step_s, self._limits, self._pause_times = step_s, limits, pause_times
        standing = Leg(Phase.WAIT, 0, 0.0, 0.0, ReferenceState(start_deg, 0.0))
        self._decided = deque([standing])
        self._kept: tuple[Leg, ...] = ()
        self._column_times_s = deque([0.0])
        self._first_column = 0

    @property
    def decided_s(self) -> float:
        """Until when the motion is decided."""
        return self.ticks * self._step_s

    @property
    def end_s(self) -> float:
        """When the table rests, as far as that is known."""
        return (self._kept or self._decided)[-1].end_s

    def take(self, step: Step) -> tuple[Leg, ...]:
        """Add a step, and return its legs."""
        begin_s = self.decided_s
        legs = self._pause(step, begin_s) if step.kind is Kind.PAUSE else (self._leg(step, begin_s),)
        self.ticks = math.ceil(legs[-1].end_s / self._step_s - _ROUNDING_S)
        if step.kind in (Kind.SCAN, Kind.PAUSE):
            self._column_times_s.append(next(leg.end_s for leg in reversed(legs) if leg.phase is not Phase.WAIT))
        start, kept = step.end, []
        for k, (acceleration, end, halts) in enumerate(step.kept):
            begin = (self.ticks + k) * self._step_s
            kept.append(
                self._halt(start, begin)
                if halts
                else Leg(Phase.SCAN, start.location, begin, self._step_s, _reference(start), acceleration)
            )
            start = end
        self._kept = tuple(kept)
        self._add(legs)
        return legs

    def stop(self, at: State) -> Leg:
        """Add the stop at the end of the path, and return it."""
        leg = stop_leg(at.location, self.decided_s, _reference(at), self._limits)
        self._add([leg])
        return leg

    def leg_at(self, time_s: float) -> Leg:
        """Return the leg at a time; the first one remembered before it all, the last one after."""
        for legs in (self._kept, self._decided):
            for leg in reversed(legs):
                if leg.start_s <= time_s:
                    return leg
        return self._decided[0]

    def state_at(self, time_s: float) -> ReferenceState:
        """Return the planned angle and speed at a time; at rest after the last leg."""
        leg = self.leg_at(time_s)
        return leg.state_at(min(max(time_s, leg.start_s), leg.end_s))

    def column_time_s(self, column: int) -> float:
        """Return when a scan location is reached; infinite where that is not decided."""
        place = column - self._first_column
        return self._column_times_s[max(place, 0)] if place < len(self._column_times_s) else math.inf

    def _leg(self, step: Step, begin_s: float) -> Leg:
        if step.kind is Kind.HALT:
            return self._halt(step.start, begin_s)
        phase = Phase.WAIT if step.kind is Kind.WAIT else Phase.SCAN
        column, state = step.start.location, _reference(step.start)
        return Leg(phase, column, begin_s, self._step_s, state, step.acceleration_deg_s2)

    def _halt(self, start: State, begin_s: float) -> Leg:
        """Return the leg that brings the table to rest at the angle where it is, in whole steps."""
        state = _reference(start)
        steps = math.ceil(halt_s(state, self._limits) / self._step_s - _ROUNDING_S)
        return wait_leg(start.location, begin_s, steps * self._step_s, state, self._limits)

    def _pause(self, step: Step, begin_s: float) -> tuple[Leg, ...]:
        """Return the legs of a pause, and a wait until the time step in which it ends is over."""
        pause = Pause(step.start.location, step.start.angle_deg, step.end.angle_deg)
        legs = tuple(pause_legs(pause, begin_s, _reference(step.start), self._limits, self._pause_times))
        end_s = legs[-1].end_s
        left_s = math.ceil(end_s / self._step_s - _ROUNDING_S) * self._step_s - end_s
        if left_s <= _ROUNDING_S:
            return legs
        return (*legs, Leg(Phase.WAIT, step.end.location, end_s, left_s, _reference(step.end)))

    def _add(self, legs: Iterable[Leg]) -> None:
        self._decided.extend(legs)
        since_s = self.decided_s - _REMEMBERED_S
        while self._decided[0].end_s < since_s and len(self._decided) > 1:
            self._decided.popleft()
        while self._column_times_s[0] < since_s and len(self._column_times_s) > 1:
            self._column_times_s.popleft()
            self._first_column += 1


def _reference(state: State) -> ReferenceState:
    return ReferenceState(state.angle_deg, state.speed_deg_s)
