"""Checks that the linear model predicts: a ramp, a step of the reference, a step of the load."""

from collections.abc import Callable

import control
import numpy as np
from numpy.typing import NDArray

from emulator.config.constants import fixed_gains
from emulator.config.table_config import TableConfig
from tools.emulated import Array, Load, Motion, emulate
from tools.tuning.check import Check, Curve, Figure, far_deg, greatest_ramp
from tools.tuning.linear_model import Teeth, duty_gains, load_ratio, moving_friction_Nm
from tools.tuning.loop import INTEGRAL_STATE, closed_loop, is_stable
from tools.tuning.loop_figures import SETTLED_SHARE

_STEP_FROM, _STEP_TO = 0.25, 0.375
"""Speeds, as shares of the maximum one."""
_LOAD_STEP = 0.0078
"""Share of the torque at standstill: 0.29 Nm for the default table."""
_BEFORE_S = 0.1
"""Time before a load step for measuring the speed without the load."""
_STARTS = 64
"""Number of start positions of steps between two counts; the mean response has no ripple of the counts."""


def ramp(config: TableConfig, seed: int) -> Check:
    """Accelerate with the maximum acceleration to half of the maximum speed, and keep it."""
    speed, acceleration, ramp_s = greatest_ramp(config)
    start_s = 0.1
    answer = emulate(config, [Motion(start_s, far_deg(config), speed, acceleration)], start_s + ramp_s + 0.5, seed=seed)
    reference = answer.reference_speed_deg_s
    moving = (answer.time_s > start_s).astype(float)
    outputs = _ramp_then_hold(config, answer.time_s, reference, moving_friction_Nm(config) * moving)
    error = reference - answer.measured_deg_s
    predicted = None if outputs is None else reference - outputs[1]
    late = (answer.time_s > start_s + 0.5 * ramp_s) & (answer.time_s <= start_s + ramp_s)
    steady = answer.time_s > start_s + ramp_s + 0.3
    lag = answer.reference_deg - answer.encoder_deg
    linear_lag = None if outputs is None else np.cumsum(reference - outputs[0]) / config.control.tick_hz
    return Check(
        "ramp",
        "ramp",
        "speed error (deg/s)",
        Curve(answer.time_s, error, predicted),
        (
            Figure(
                "ramp_lag_deg_s",
                f"speed lag on a ramp of {acceleration:.3g} deg/s2",
                "deg/s",
                *_means(error, predicted, late),
            ),
            Figure(
                "cruise_lag_deg",
                f"encoder behind the reference at {speed:.3g} deg/s",
                "deg",
                *_means(lag, linear_lag, steady),
            ),
        ),
    )


def step(config: TableConfig, seed: int) -> Check:
    """Apply a step of the reference from one speed to another, with the constant-speed set."""
    low, high = (share * config.limits.speed_deg_s for share in (_STEP_FROM, _STEP_TO))
    height, at_s = high - low, _cruising_s(config)
    in_one_tick = 2.0 * height * config.control.tick_hz
    motions = [
        Motion(0.1, far_deg(config), low, greatest_ramp(config)[1]),
        Motion(at_s, far_deg(config), high, in_one_tick),
    ]
    time_s, speed_deg_s = _mean_speed(config, motions, at_s + 0.3, [], seed)
    model = _after_step(config, time_s, at_s, height, 0.0)
    seen = speed_deg_s - low
    after = time_s > at_s
    overshoot = _pair(seen, model, lambda curve: max(0.0, float(100.0 * (curve[after].max() / height - 1.0))))
    settling = _pair(seen, model, lambda curve: _settling_ms(time_s[after] - at_s, curve[after] - height, height))
    window = time_s > at_s - 0.02
    return Check(
        "step",
        f"step of the reference from {low:.3g} to {high:.3g} deg/s",
        "speed gained (deg/s)",
        Curve(time_s[window] - at_s, seen[window], None if model is None else model[window]),
        (
            Figure("step_overshoot_percent", "overshoot", "%", *overshoot),
            Figure("step_settling_ms", "settling to 10 % after a step", "ms", *settling),
        ),
    )


def load_step(config: TableConfig, seed: int) -> Check:
    """Apply a load to the table while it turns at a constant speed."""
    speed, load_Nm, at_s = _STEP_FROM * config.limits.speed_deg_s, load_step_Nm(config), _cruising_s(config)
    motions = [Motion(0.1, far_deg(config), speed, greatest_ramp(config)[1])]
    time_s, speed_deg_s = _mean_speed(config, motions, at_s + 0.3, [Load(at_s, load_Nm)], seed)
    model = _after_step(config, time_s, at_s, 0.0, load_Nm)
    after = time_s > at_s
    seen = (
        speed_deg_s - speed_deg_s[~after & (time_s > at_s - _BEFORE_S)].mean()
    )  # a loop with low gains may not have settled
    peaks = _pair(seen, model, lambda curve: float(-curve[after].min()))
    height = peaks[0] if peaks[1] is None else peaks[1]
    settling = _pair(seen, model, lambda curve: _settling_ms(time_s[after] - at_s, curve[after], height))
    window = time_s > at_s - 0.02
    return Check(
        "load_step",
        f"load step of {load_Nm:g} Nm",
        "speed gained (deg/s)",
        Curve(time_s[window] - at_s, seen[window], None if model is None else model[window]),
        (
            Figure("load_peak_deg_s", "peak after the load step", "deg/s", *peaks),
            Figure("load_settling_ms", "settling to 10 % of it", "ms", *settling),
        ),
    )


def load_step_Nm(config: TableConfig) -> float:
    """Return the load on the table: a small share of the motor's torque."""
    at_motor_Nm = config.motor.torque_constant_Nm_A * config.driver.supply_V / config.motor.resistance_ohm
    return float(f"{_LOAD_STEP * at_motor_Nm / load_ratio(config, Teeth.DRIVING):.2g}")


def _cruising_s(config: TableConfig) -> float:
    """Return a time at which a table that was started at 0.1 s has settled at the lower speed of a step."""
    return 0.9 + _STEP_FROM * config.limits.speed_deg_s / greatest_ramp(config)[1]


def _mean_speed(
    config: TableConfig, motions: list[Motion], duration_s: float, loads: list[Load], seed: int
) -> tuple[Array, Array]:
    """Return times, and the table's speed as the mean of runs from several starts."""
    answers = [emulate(config, motions, duration_s, loads, seed + start) for start in range(_STARTS)]
    return answers[0].time_s, np.mean([answer.true_speed_deg_s for answer in answers], axis=0)


def _after_step(
    config: TableConfig, time_s: Array, at_s: float, reference_deg_s: float, load_Nm: float
) -> Array | None:
    """Return the linear response of the speed to a step in the constant-speed set; None if the loop is not stable."""
    after = (time_s > at_s).astype(float)
    loop = closed_loop(config, Teeth.DRIVING, fixed_gains(config, config.gains.hold))
    if not is_stable(loop):
        return None
    # A load that acts in a tick is an input at its start, a sample before its end.
    load = np.append((load_Nm * after)[1:], load_Nm)
    result: Array = _linear(loop, time_s, reference_deg_s * after, load)[0]
    return result


def _ramp_then_hold(config: TableConfig, time_s: Array, reference_deg_s: Array, load_Nm: Array) -> Array | None:
    """Return the result of `_linear` for a loop that changes without a bump to the constant-speed set after the ramp.

    There is no response if one of the loops is not stable.
    """
    ramp, hold = (fixed_gains(config, gains) for gains in (config.gains.ramp, config.gains.hold))
    loops = [closed_loop(config, Teeth.DRIVING, gains) for gains in (ramp, hold)]
    if not all(map(is_stable, loops)):
        return None
    inputs = np.vstack([reference_deg_s, load_Nm, np.zeros_like(time_s)])
    first = control.forced_response(loops[0], time_s, inputs, return_x=True)
    switch = int(np.flatnonzero(np.diff(reference_deg_s))[-1]) + 2  # the first tick with a constant reference
    state, measured = first.states[:, switch].copy(), first.outputs[1]
    error, change = reference_deg_s[switch] - measured[switch], measured[switch] - measured[switch - 1]
    proportional, _, derivative = duty_gains(config, ramp) - duty_gains(config, hold)
    state[INTEGRAL_STATE] += proportional * error - derivative * change
    second = control.forced_response(loops[1], time_s[switch:], inputs[:, switch:], state)
    result: Array = np.hstack([first.outputs[:, :switch], second.outputs])
    return result


def _linear(loop: control.StateSpace, time_s: Array, reference_deg_s: Array, load_Nm: Array) -> Array:
    """Return speed, measured speed and duty of the closed loop."""
    response = control.forced_response(loop, time_s, np.vstack([reference_deg_s, load_Nm, np.zeros_like(time_s)]))
    outputs: Array = response.outputs
    return outputs


def _means(seen: Array, predicted: Array | None, where: NDArray[np.bool_]) -> tuple[float, float | None]:
    return _pair(seen, predicted, lambda curve: float(curve[where].mean()))


def _pair(seen: Array, predicted: Array | None, figure: Callable[[Array], float]) -> tuple[float, float | None]:
    """Return a figure of the emulator and, if there is one, of the linear response."""
    return figure(seen), None if predicted is None else figure(predicted)


def _settling_ms(time_s: Array, deviation: Array, height: float) -> float:
    """Return the time at which the deviation last leaves a band of a tenth of the height."""
    outside = np.flatnonzero(np.abs(deviation) > SETTLED_SHARE * height)
    return float(1e3 * time_s[outside[-1]]) if len(outside) else 0.0
