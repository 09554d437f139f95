"""The motion that a recording needs: each part brings out another constant of the table.

One chain of motions, each replaced by the next before it ends, so that the regulator's integral is never reset: the lag
of the encoder behind the reference is then the integral of the speed error, and tells the duty.

| part | brings out |
|---|---|
| fast turns, both ways | gain: the lag grows with the speed |
| creeping, both ways | Coulomb friction and stiction: the lag jumps with the direction |
| quick reversals | inertia, and backlash: the teeth part, and meet again |
"""

from random import Random
from typing import NamedTuple


class Turn(NamedTuple):
    """Run at a speed in one direction, for a time."""

    duration_s: float
    speed_deg_s: float  # signed
    acceleration_deg_s2: float


_FAST = (1.0, 0.5)
_CREEP = (0.0125, 0.025, 0.05, 0.1)
_QUICK = (0.5, 0.125)
_FAST_SHARE, _CREEP_SHARE = 0.12, 0.28
_OVERTIME = 1.1  # of a quick turn, over the time that its reversal takes


def excitation(duration_s: float, speed_deg_s: float, acceleration_deg_s2: float, seed: int) -> list[Turn]:
    """Return the turns of a recording.

    Args:
        duration_s: How long it lasts.
        speed_deg_s: The greatest speed that may be used.
        acceleration_deg_s2: The greatest acceleration that may be used.
        seed: Of the irregular durations, which keep the readings from falling on the same angles again and again.
    """
    chance = Random(seed)  # noqa: S311  # spreads the readings

    def pairs(length_s: float, count: int, share: float) -> list[Turn]:
        """Return turns there and back, each pair of equal length, so that the table stays near its start."""
        each_s = [length_s / count / 2.0 * chance.uniform(0.8, 1.2) for _ in range(count)]
        speed = share * speed_deg_s
        return [Turn(turn_s, direction * speed, acceleration_deg_s2) for turn_s in each_s for direction in (1.0, -1.0)]

    def quick(length_s: float, share: float) -> list[Turn]:
        reversal_s = 2.0 * share * speed_deg_s / acceleration_deg_s2
        return pairs(length_s, max(1, round(length_s / (2.0 * _OVERTIME * reversal_s))), share)

    fast_s, creep_s = _FAST_SHARE * duration_s, _CREEP_SHARE * duration_s
    quick_s = duration_s - fast_s - creep_s
    return [
        *(turn for share in _FAST for turn in pairs(fast_s / len(_FAST), 1, share)),
        *(turn for share in _CREEP for turn in pairs(creep_s / len(_CREEP), 2, share)),
        *(turn for share in _QUICK for turn in quick(quick_s / len(_QUICK), share)),
    ]
