"""The quadrature encoder on the motor's shaft and its 32-bit counter.

It sits before the gears, so it does not see the backlash: the table's true angle differs from the encoder's by it.
"""

import math
from typing import NamedTuple

from emulator.int32 import wrap_int32


class Encoder(NamedTuple):
    """Counts per radian of the motor, and where between two edges the shaft stood at power-on (0..1)."""

    count_rad: float
    phase: float

    @classmethod
    def of(cls, lines: int, phase: float) -> "Encoder":
        """Return the encoder of a disc with that many lines a turn: each gives four counts."""
        return cls(4 * lines / (2.0 * math.pi), phase)


def count_at(parameters: Encoder, angle_rad: float) -> int:
    """Return the counter at a motor angle; it wraps as a 32-bit register does."""
    return wrap_int32(math.floor(angle_rad * parameters.count_rad + parameters.phase))


def recounted(parameters: Encoder, angle_rad: float, count: int) -> Encoder:
    """Return the encoder whose counter reads `count` at this motor angle; the shaft stays between the same edges."""
    counted = math.floor(angle_rad * parameters.count_rad + parameters.phase) - count
    return parameters._replace(phase=parameters.phase - counted)


def angle_within_tick(start_rad: float, end_rad: float, start_speed_rad_s: float, tick_s: float, share: float) -> float:
    """Return the shaft's angle at a share (0..1) of a tick, from both ends and the speed at the start.

    The greatest acceleration that the motor can give, 1.1e5 rad/s2 without load, bends the way within a tick by less
    than one count; this parabola follows it.
    """
    straight = start_speed_rad_s * tick_s
    return start_rad + straight * share + (end_rad - start_rad - straight) * share * share
