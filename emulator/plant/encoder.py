"""The quadrature encoder on the motor's shaft and its 32-bit counter.

It is before the gears, so it does not measure the backlash: the true angle of the table differs from the encoder's by
it.
"""

import math
from typing import NamedTuple

from emulator.int32 import wrap_int32


class Encoder(NamedTuple):
    """Counts per radian of the motor, and the position of the shaft between two edges at power-on (0..1)."""

    count_rad: float
    phase: float

    @classmethod
    def of(cls, lines: int, phase: float) -> "Encoder":
        """Return the encoder of a disc with the given number of lines; each line gives four counts."""
        return cls(4 * lines / (2.0 * math.pi), phase)


def count_at(parameters: Encoder, angle_rad: float) -> int:
    """Return the counter at a motor angle; it wraps as a 32-bit register does."""
    return wrap_int32(math.floor(angle_rad * parameters.count_rad + parameters.phase))


def recounted(parameters: Encoder, angle_rad: float, count: int) -> Encoder:
    """Return the encoder whose counter reads `count` at this motor angle. The shaft stays between the same edges."""
    counted = math.floor(angle_rad * parameters.count_rad + parameters.phase) - count
    return parameters._replace(phase=parameters.phase - counted)


def angle_within_tick(start_rad: float, end_rad: float, start_speed_rad_s: float, tick_s: float, share: float) -> float:
    """Return the shaft's angle at a share (0..1) of a tick, from the angles at both ends and the speed at the start.

    The maximum acceleration of the motor, 1.1e5 rad/s2 without load, bends the path within a tick by less than one
    count. This parabola follows it.
    """
    straight = start_speed_rad_s * tick_s
    return start_rad + straight * share + (end_rad - start_rad - straight) * share * share
