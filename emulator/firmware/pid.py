"""The speed PID in fixed point, with two gain sets, bumpless switching and anti-windup.

    u = K (e + integral(e) / Ti - Td d(omega)/dt),    e = r - omega_R        (Fig. 3 of the paper)

The derivative acts only on the measured speed, so a step of the reference causes no peak. All numbers are integers; see
`fixed_point`.
"""

from typing import NamedTuple

from emulator.firmware.fixed_point import ERROR_BITS, ERROR_MAX, INTEGRAL_GAIN_BITS, OUTPUT_BITS, clamp

RAMP = 0
HOLD = 1

_HALF = 1 << (OUTPUT_BITS - 1)
_INTEGRAL_SHIFT = ERROR_BITS + INTEGRAL_GAIN_BITS - OUTPUT_BITS


class Gains(NamedTuple):
    """One gain set in the firmware's formats: PWM steps for a speed error of one count per window."""

    proportional: int  # 12 fraction bits
    integral: int  # per tick, 16 fraction bits
    derivative: int  # for a change of one count per window in a tick, 12 fraction bits


class Pid(NamedTuple):
    """The constants of the PID."""

    ramp: Gains
    hold: Gains
    duty_max: int  # PWM steps


class PidState(NamedTuple):
    """The state of the PID from tick to tick."""

    integral: int  # PWM steps, 20 fraction bits
    measured: int  # count/window
    gain_set: int
    duty: int  # PWM steps


def switched_off(state: PidState, measured: int) -> PidState:
    """Return the state of the PID while the drive is off: only the speed is kept."""
    return PidState(0, measured, state.gain_set, 0)


def step(parameters: Pid, state: PidState, gain_set: int, demand: int, measured: int) -> PidState:
    """Return the state of the PID after one tick.

    Args:
        parameters: the constants of the PID.
        state: its state before the tick.
        gain_set: `RAMP` or `HOLD`.
        demand: reference speed, count/window with 8 fraction bits.
        measured: measured speed, count/window.
    """
    gains = parameters.ramp if gain_set == RAMP else parameters.hold
    error = clamp(demand - (measured << ERROR_BITS), ERROR_MAX)
    change = clamp((measured - state.measured) << ERROR_BITS, ERROR_MAX)
    direct = gains.proportional * error - gains.derivative * change
    integral = state.integral
    if gain_set != state.gain_set:
        before = parameters.hold if gain_set == RAMP else parameters.ramp
        integral += before.proportional * error - before.derivative * change - direct  # no step of the output
    growth = (gains.integral * error) >> _INTEGRAL_SHIFT
    top = parameters.duty_max << OUTPUT_BITS
    output = direct + integral + growth
    if (output < top or growth < 0) and (output > -top or growth > 0):  # saturated: the integral must not grow
        integral += growth
    integral = clamp(integral, top)
    duty = clamp((direct + integral + _HALF) >> OUTPUT_BITS, parameters.duty_max)
    return PidState(integral, measured, gain_set, duty)
