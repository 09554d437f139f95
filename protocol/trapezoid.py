"""The trapezoidal velocity profile that P, S and A prescribe, in closed form (section 2.1; clauses 7.1 and 7.3).

A table's controller plans nothing ahead. At any time its reference moves at the maximum speed that A, S and the
remaining braking distance allow, from its present position and speed. So the reference is known from a command until it
stands: a few segments of constant acceleration. This is not the code of a table.
"""

import math
from collections.abc import Iterable, Iterator
from typing import NamedTuple

# Smaller distances in degrees are rounding: the firmware's own unit is a hundred times coarser.
_ROUNDING_DEG = 1e-9


class ReferenceState(NamedTuple):
    """The position and speed of the reference."""

    angle_deg: float
    speed_deg_s: float


class MotionCommand(NamedTuple):
    """One motion of the table: `P` with its latched `S` and `A`, the last two above 0."""

    target_deg: float
    speed_deg_s: float
    acceleration_deg_s2: float


class Segment(NamedTuple):
    """A segment of constant acceleration."""

    duration_s: float
    acceleration_deg_s2: float


class Motion(NamedTuple):
    """A motion from a position and a speed to a target, as a sequence of phases."""

    start: ReferenceState
    target_deg: float
    segments: tuple[Segment, ...]

    @classmethod
    def of(cls, state: ReferenceState, command: MotionCommand) -> "Motion":
        """Return the motion from a state that a command prescribes."""
        return cls(state, command.target_deg, tuple(segments(state, command)))

    @classmethod
    def at_rest(cls, angle_deg: float) -> "Motion":
        """Return the motion of a table that stands."""
        return cls(ReferenceState(angle_deg, 0.0), angle_deg, ())

    @property
    def duration_s(self) -> float:
        """The time from the command until the reference rests at the target."""
        return sum(segment.duration_s for segment in self.segments)

    def at(self, time_s: float) -> ReferenceState:
        """Return the position and speed of the reference at a time since the command."""
        return _along(self.segments, self.start, max(time_s, 0.0)) or ReferenceState(self.target_deg, 0.0)


def move(state: ReferenceState, acceleration_deg_s2: float, duration_s: float) -> ReferenceState:
    """Return the state after a time of constant acceleration: Eq. (3) and (4)."""
    angle, speed = state
    return ReferenceState(
        angle + speed * duration_s + 0.5 * acceleration_deg_s2 * duration_s**2,
        speed + acceleration_deg_s2 * duration_s,
    )


def segments(state: ReferenceState, command: MotionCommand) -> Iterator[Segment]:
    """Yield the segments of the reference from a command until it stands at the target.

    If the target is behind, or nearer than the braking distance, it brakes at A to zero, passes, and returns. If the
    new speed is lower than the present one, it brakes at A to S.
    """
    target, top_speed, rate = command
    distance, speed = target - state.angle_deg, state.speed_deg_s
    forward = 1.0 if distance > 0.0 or (distance == 0.0 and speed < 0.0) else -1.0
    distance, speed = forward * distance, forward * speed
    if speed < 0.0:
        yield Segment(-speed / rate, forward * rate)
        distance, speed = distance - braking_way_deg(speed, rate), 0.0
    passes_by_deg = braking_way_deg(speed, rate) - distance
    if passes_by_deg > _ROUNDING_DEG:
        yield Segment(speed / rate, -forward * rate)
        forward, distance, speed = -forward, passes_by_deg, 0.0
    if speed > top_speed:
        yield Segment((speed - top_speed) / rate, -forward * rate)
        distance, speed = distance - braking_way_deg(speed, rate) + braking_way_deg(top_speed, rate), top_speed
    peak = max(speed, min(top_speed, math.sqrt(max(0.0, rate * distance + 0.5 * speed**2))))
    if peak > 0.0:
        yield Segment((peak - speed) / rate, forward * rate)
        ways_of_ramps = 2.0 * braking_way_deg(peak, rate) - braking_way_deg(speed, rate)
        yield Segment(max(0.0, distance - ways_of_ramps) / peak, 0.0)
        yield Segment(peak / rate, -forward * rate)


def advance(state: ReferenceState, command: MotionCommand, duration_s: float) -> ReferenceState:
    """Return the reference `duration_s` after a command; once it stands, exactly at the target."""
    if math.isinf(command.target_deg):
        return _go_on(state, command, duration_s)
    return _along(segments(state, command), state, duration_s) or ReferenceState(command.target_deg, 0.0)


def time_to_rest_s(state: ReferenceState, command: MotionCommand) -> float:
    """Return the time until the reference stands at the target."""
    return sum(segment.duration_s for segment in segments(state, command))


def way_to_rest_deg(state: ReferenceState, command: MotionCommand) -> tuple[float, float]:
    """Return the minimum and maximum angle of the reference until it stands at the target."""
    ends = [state.angle_deg, command.target_deg]
    for segment in segments(state, command):
        state = move(state, segment.acceleration_deg_s2, segment.duration_s)
        ends.append(state.angle_deg)
    return min(ends), max(ends)


def braking_way_deg(speed_deg_s: float, rate_deg_s2: float) -> float:
    """Return the signed distance from a speed to standstill: the nearest point at which the table can stand."""
    return 0.5 * speed_deg_s * abs(speed_deg_s) / rate_deg_s2


def _along(parts: Iterable[Segment], state: ReferenceState, time_s: float) -> ReferenceState | None:
    """Return the state at a time from the beginning of the first segment; None after the last."""
    for segment in parts:
        if time_s < segment.duration_s:
            return move(state, segment.acceleration_deg_s2, time_s)
        state = move(state, segment.acceleration_deg_s2, segment.duration_s)
        time_s -= segment.duration_s
    return None


def _go_on(state: ReferenceState, command: MotionCommand, duration_s: float) -> ReferenceState:
    """Return the reference during a motion to a target at infinity: one ramp, and then its S."""
    target, top_speed, rate = command
    angle, speed = state
    top = math.copysign(top_speed, target)
    ramp_s = abs(top - speed) / rate
    if duration_s < ramp_s:
        return move(state, math.copysign(rate, top - speed), duration_s)
    return ReferenceState(angle + 0.5 * (speed + top) * ramp_s + top * (duration_s - ramp_s), top)
