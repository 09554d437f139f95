"""The trapezoidal velocity profile of the table's controller for P, S and A, in continuous time (section 2.1).

The controller has no plan. At any time its reference moves at the maximum speed that A, S and the remaining braking
distance allow, from its present position and speed. These rules determine the reference for all later times, in closed
form: a few segments of constant acceleration.
"""

import math
from collections.abc import Iterator
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


class Stretch(NamedTuple):
    """A segment of constant acceleration."""

    duration_s: float
    acceleration_deg_s2: float


def move(state: ReferenceState, acceleration_deg_s2: float, duration_s: float) -> ReferenceState:
    """Return the state after a time of constant acceleration: Eq. (3) and (4)."""
    angle, speed = state
    return ReferenceState(
        angle + speed * duration_s + 0.5 * acceleration_deg_s2 * duration_s**2,
        speed + acceleration_deg_s2 * duration_s,
    )


def stretches(state: ReferenceState, command: MotionCommand) -> Iterator[Stretch]:
    """Yield the segments of the reference from a command until it stands at the target.

    If the target is behind, or nearer than the braking distance, it brakes at A to zero, passes, and returns. If the
    new speed is lower than the present one, it brakes at A to S.
    """
    target, top_speed, rate = command
    distance, speed = target - state.angle_deg, state.speed_deg_s
    forward = 1.0 if distance > 0.0 or (distance == 0.0 and speed < 0.0) else -1.0
    distance, speed = forward * distance, forward * speed
    if speed < 0.0:
        yield Stretch(-speed / rate, forward * rate)
        distance, speed = distance + _braking_deg(speed, rate), 0.0
    passes_by_deg = _braking_deg(speed, rate) - distance
    if passes_by_deg > _ROUNDING_DEG:
        yield Stretch(speed / rate, -forward * rate)
        forward, distance, speed = -forward, passes_by_deg, 0.0
    if speed > top_speed:
        yield Stretch((speed - top_speed) / rate, -forward * rate)
        distance, speed = distance - _braking_deg(speed, rate) + _braking_deg(top_speed, rate), top_speed
    peak = max(speed, min(top_speed, math.sqrt(rate * distance + 0.5 * speed**2)))
    if peak > 0.0:
        yield Stretch((peak - speed) / rate, forward * rate)
        ways_of_ramps = 2.0 * _braking_deg(peak, rate) - _braking_deg(speed, rate)
        yield Stretch(max(0.0, distance - ways_of_ramps) / peak, 0.0)
        yield Stretch(peak / rate, -forward * rate)


def advance(state: ReferenceState, command: MotionCommand, duration_s: float) -> ReferenceState:
    """Return the reference `duration_s` after a command; once it stands, exactly at the target."""
    if math.isinf(command.target_deg):
        return _go_on(state, command, duration_s)
    left_s = duration_s
    for stretch in stretches(state, command):
        if left_s < stretch.duration_s:
            return move(state, stretch.acceleration_deg_s2, left_s)
        state = move(state, stretch.acceleration_deg_s2, stretch.duration_s)
        left_s -= stretch.duration_s
    return ReferenceState(command.target_deg, 0.0)


def _go_on(state: ReferenceState, command: MotionCommand, duration_s: float) -> ReferenceState:
    """Return the reference during a motion to a target at infinity: one ramp, and then its S."""
    target, top_speed, rate = command
    angle, speed = state
    top = math.copysign(top_speed, target)
    ramp_s = abs(top - speed) / rate
    if duration_s < ramp_s:
        return move(state, math.copysign(rate, top - speed), duration_s)
    return ReferenceState(angle + 0.5 * (speed + top) * ramp_s + top * (duration_s - ramp_s), top)


def time_to_rest_s(state: ReferenceState, command: MotionCommand) -> float:
    """Return the time until the reference stands at the target."""
    return sum(stretch.duration_s for stretch in stretches(state, command))


def way_to_rest_deg(state: ReferenceState, command: MotionCommand) -> tuple[float, float]:
    """Return the minimum and maximum angle of the reference until it stands at the target."""
    ends = [state.angle_deg, command.target_deg]
    for stretch in stretches(state, command):
        state = move(state, stretch.acceleration_deg_s2, stretch.duration_s)
        ends.append(state.angle_deg)
    return min(ends), max(ends)


def _braking_deg(speed_deg_s: float, rate_deg_s2: float) -> float:
    """Return the braking distance from a speed to standstill."""
    return 0.5 * speed_deg_s**2 / rate_deg_s2
