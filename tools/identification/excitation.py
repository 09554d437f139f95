"""The motion for a recording: each part makes another constant of the table identifiable.

| part | identifies |
|---|---|
| fast swings | gain: the lag of the encoder behind the reference grows with the speed |
| slow swings | Coulomb friction and stiction: the lag jumps with the direction |
| short swings | inertia, and backlash: the teeth separate and touch again |

A burst is a sequence of swings back and forth around home, from rest to rest. A swing never reaches the maximum speed.
The table accelerates over half of the travel and brakes over the other half, so only one gain set is used. The next
target, on the other side, is sent during the braking: the table continues to brake, and reverses. So the time of that
command has no effect. Only the firmware determines the timing of a burst, from its first command on. At the end of a
burst the table comes to rest, and the PID resets its integral: the lag before that does not add to the lag after it.

The reversal points are at least a degree apart. Within a wider gap the table would float, and its position would be
unknown.
"""

from math import copysign, floor, sqrt
from random import Random
from typing import NamedTuple

REST_S = 0.5
"""Time for the table to settle after a burst."""

_MOTION_S = 3.5
"""Approximate duration of the motion of a burst.

With many bursts in a recording, errors of the first commands' times cancel.
"""

_LEAST_WIDTH_DEG = 1.0
_BRAKING = 0.75
"""Time of the next target, as a share of a swing's duration: in the middle of the braking."""


class Move(NamedTuple):
    """A swing, and the time of its target. Times count from the burst's first command, angles from home."""

    send_s: float
    begin_s: float
    from_deg: float
    to_deg: float


class Reference(NamedTuple):
    """The profile at an instant."""

    angle_deg: float  # from home
    speed_deg_s: float
    acceleration_deg_s2: float


class Burst(NamedTuple):
    """Swings about home with one acceleration."""

    acceleration_deg_s2: float
    moves: tuple[Move, ...]
    end_s: float  # of the motion

    @property
    def duration_s(self) -> float:
        """Duration including the rest."""
        return self.end_s + REST_S

    def reference(self, time_s: float) -> Reference:
        """Return the profile at a time after the first command."""
        if not 0.0 < time_s < self.end_s:
            return Reference(0.0, 0.0, 0.0)
        move = next(move for move in reversed(self.moves) if move.begin_s <= time_s)
        way_deg = abs(move.to_deg - move.from_deg)
        acceleration = copysign(self.acceleration_deg_s2, move.to_deg - move.from_deg)
        since_s, left_s = time_s - move.begin_s, move.begin_s + _swing_s(way_deg, self.acceleration_deg_s2) - time_s
        if since_s < left_s:
            return Reference(move.from_deg + acceleration * since_s**2 / 2.0, acceleration * since_s, acceleration)
        return Reference(move.to_deg - acceleration * left_s**2 / 2.0, acceleration * left_s, -acceleration)


class Swing(NamedTuple):
    """A part of the excitation, in shares of the whole duration and of the maximum speed and acceleration."""

    duration: float
    speed: float
    acceleration: float


SWINGS = (
    Swing(0.11, 0.9, 0.4),
    Swing(0.08, 0.1, 0.05),
    Swing(0.09, 0.025, 0.01),
    Swing(0.36, 0.35, 1.0),
    Swing(0.36, 0.7, 1.0),
)


def excitation(duration_s: float, speed_deg_s: float, acceleration_deg_s2: float, seed: int) -> list[Burst]:
    """Return the bursts of a recording.

    Args:
        duration_s: approximate duration.
        speed_deg_s: maximum speed.
        acceleration_deg_s2: maximum acceleration.
        seed: random seed of the irregular widths, which prevent readings at the same angles.
    """
    chance = Random(seed)  # noqa: S311  # spreads the readings
    bursts: list[Burst] = []
    left_s = 0.0
    for swing in SWINGS:
        left_s += swing.duration * duration_s
        burst = _burst(swing, speed_deg_s, acceleration_deg_s2, chance)
        while left_s >= burst.duration_s / 2.0:
            bursts.append(burst)
            left_s -= burst.duration_s
            burst = _burst(swing, speed_deg_s, acceleration_deg_s2, chance)
    return bursts


def _burst(swing: Swing, most_deg_s: float, most_deg_s2: float, chance: Random) -> Burst:
    speed_deg_s = swing.speed * most_deg_s * chance.uniform(0.8, 1.0)
    acceleration = max(
        0.1, floor(10.0 * min(swing.acceleration * most_deg_s2, speed_deg_s**2 / _LEAST_WIDTH_DEG)) / 10.0
    )
    reach_deg = max(round(speed_deg_s**2 / acceleration / 2.0, 1), 0.1)
    pairs = max(1, round(_MOTION_S / (2.0 * _swing_s(2.0 * reach_deg, acceleration))))
    moves, send_s, begin_s, from_deg = [], 0.0, 0.0, 0.0
    for to_deg in (reach_deg, *[-reach_deg, reach_deg] * (pairs - 1), -reach_deg, 0.0):
        moves.append(Move(send_s, begin_s, from_deg, to_deg))
        swing_s = _swing_s(abs(to_deg - from_deg), acceleration)
        send_s, begin_s, from_deg = begin_s + _BRAKING * swing_s, begin_s + swing_s, to_deg
    return Burst(acceleration, tuple(moves), begin_s)


def _swing_s(way_deg: float, acceleration_deg_s2: float) -> float:
    """Return the time for accelerating over half of the travel, and braking over the other half."""
    return 2.0 * sqrt(way_deg / acceleration_deg_s2)
