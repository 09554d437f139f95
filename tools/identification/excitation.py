"""The motion that a recording needs: each part brings out another constant of the table.

| part | brings out |
|---|---|
| fast swings | gain: the lag of the encoder behind the reference grows with the speed |
| slow swings | Coulomb friction and stiction: the lag jumps with the direction |
| quick swings | inertia, and backlash: the teeth part, and meet again |

A swing speeds up one way, then the other, and never holds a speed, so one gain set alone is at work. Each motion is
replaced by the next before it ends, so the regulator's integral is never reset: then the lag is the integral of the
speed error, and tells the duty. (A change of the gain set would keep the duty, and so forget a little of the lag.) No
swing is narrower than a degree: within a wider gap the table would float, and no one could tell where.
"""

from random import Random
from typing import NamedTuple


class Turn(NamedTuple):
    """Speed up in one direction, for a time."""

    duration_s: float
    direction: int
    acceleration_deg_s2: float


class Swing(NamedTuple):
    """A part of the excitation, in shares of the greatest duration, speed and acceleration."""

    duration: float
    speed: float
    acceleration: float


SWINGS = (
    Swing(0.15, 0.9, 0.2),
    Swing(0.2, 0.1, 0.02),
    Swing(0.12, 0.025, 0.005),
    Swing(0.27, 0.5, 1.0),
    Swing(0.26, 0.3, 1.0),
)


def excitation(duration_s: float, speed_deg_s: float, acceleration_deg_s2: float, seed: int) -> list[Turn]:
    """Return the turns of a recording.

    Args:
        duration_s: How long it lasts, about.
        speed_deg_s: The greatest speed that may be used.
        acceleration_deg_s2: The greatest acceleration that may be used.
        seed: Of the irregular durations, which keep the readings from falling on the same angles again and again.
    """
    chance = Random(seed)  # noqa: S311  # spreads the readings
    turns = []
    for swing in SWINGS:
        acceleration = max(0.1, swing.acceleration * acceleration_deg_s2)
        longest_s = swing.speed * speed_deg_s / acceleration
        pairs = max(1, round(swing.duration * duration_s / (4.0 * 0.9 * longest_s)))
        for _ in range(pairs):
            quarter_s = longest_s * chance.uniform(0.8, 1.0)
            for share, direction in ((1.0, 1), (2.0, -1), (1.0, 1)):
                turns.append(Turn(share * quarter_s, direction, acceleration))
    return turns
