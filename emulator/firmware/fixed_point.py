"""The firmware's number formats: integers with a stated number of fraction bits.

Each quantity fits a 32-bit register. A product of two, and a distance with its fraction, fit 64 bits. A right shift
rounds toward minus infinity, as an arithmetic shift on the controller does.

| quantity | unit | fraction bits | register |
|---|---|---|---|
| position | encoder count | 0, and a second word of M | 32 + M |
| distance | encoder count | 0, and a second word of M | 64 - M, and M: braking may lead far away from the target |
| speed | count/tick | M | 32 |
| acceleration | count/tick^2 | M | 32 |
| speed error | count/window | 8 | 32, so less than 2^21 counts a window |
| proportional and derivative gain | PWM step/(count/window) | 12 | 32 |
| integral gain | PWM step/(count/window) a tick | 16 | 32 |
| integral, controller output | PWM step | 20 | 32 |

M, the motion's fraction bits, is a constant of the table (`motion_bits`): 26 for the default one.
"""

from fractions import Fraction

from emulator.int32 import INT32_MAX

ERROR_BITS = 8
GAIN_BITS = 12
INTEGRAL_GAIN_BITS = 16
OUTPUT_BITS = ERROR_BITS + GAIN_BITS

ERROR_MAX = (1 << 29) - 1
"""Four products of this number with a gain fit 64 bits."""

FEWEST_MOTION_BITS = 9
MOST_MOTION_BITS = 30
"""With more bits, an absolute target at the far end of the counter would be too far away for 64 bits."""


def motion_bits(speed: Fraction, acceleration: Fraction) -> int:
    """Return the number of fraction bits, within limits, for which speed plus acceleration fits 32 bits.

    Args:
        speed: maximum, count/tick.
        acceleration: maximum, count/tick^2.
    """
    bits = MOST_MOTION_BITS
    while bits > FEWEST_MOTION_BITS and to_fixed(speed, bits) + to_fixed(acceleration, bits) > INT32_MAX:
        bits -= 1
    return bits


def clamp(number: int, bound: int) -> int:
    """Return `number` limited to -bound..bound."""
    if number > bound:
        return bound
    if number < -bound:
        return -bound
    return number


def to_fixed(value: Fraction | float, fraction_bits: int) -> int:
    """Return the nearest integer to `value` with the given number of fraction bits; halves are rounded to even."""
    return round(Fraction(value) * (1 << fraction_bits))


def gain_registers(proportional: float, integral: float, derivative: float) -> tuple[int, int, int]:
    """Return a gain set, in the units of the table above, as integers in the firmware's registers.

    Raises:
        OverflowError: a gain does not fit its register, or the integral gain rounds to 0.
    """
    registers = (
        to_fixed(proportional, GAIN_BITS),
        to_fixed(integral, INTEGRAL_GAIN_BITS),
        to_fixed(derivative, GAIN_BITS),
    )
    if max(registers) > INT32_MAX or registers[1] < 1:
        raise OverflowError(
            f"its registers would hold {registers}; each must be at most {INT32_MAX}, the integral gain at least 1; "
            "a finer encoder or a longer speed window lowers them"
        )
    return registers


def from_fixed(number: int, fraction_bits: int) -> float:
    """Return the value of an integer with the given number of fraction bits."""
    return number / (1 << fraction_bits)
