"""Checks without a linear model: small moves from rest, reversal through the backlash, creep against stiction."""

import numpy as np

from emulator.config.table_config import TableConfig
from emulator.firmware.controller import IDLE
from tools.emulated import Answer, Motion, emulate
from tools.tuning.check import Check, Curve, Figure, far_deg, greatest_ramp

_CREEP = 0.005
"""Share of the maximum speed."""
_CREEP_S, _SETTLED_CREEP_S = 4.0, 1.0
"""Duration of the creep after the gap, and travel of the table before its ripple is measured."""
_SMALL_MOVES_DEG = (0.1, 0.2, 0.5, 1.0, 3.0)
_LONGEST_SETTLING_S = 10.0


def small_moves(config: TableConfig, seed: int) -> Check:
    """Make small moves from rest, forward and backward, each with time enough to come to rest."""
    speed, acceleration = config.power_on.speed_deg_s, config.power_on.acceleration_deg_s2
    longest_deg = 2.0 * max(_SMALL_MOVES_DEG)
    pause_s = longest_deg / speed + speed / acceleration + min(config.protection.settling_time_s, _LONGEST_SETTLING_S)
    targets = [sign * angle for angle in _SMALL_MOVES_DEG for sign in (1.0, -1.0)]
    motions = [Motion(0.1 + index * pause_s, angle, speed, acceleration) for index, angle in enumerate(targets)]
    answer = emulate(config, motions, 0.1 + len(targets) * pause_s, seed=seed)
    ends = np.round((0.1 + np.arange(1, len(targets) + 1) * pause_s) * config.control.tick_hz).astype(int) - 2
    misses = np.abs(answer.encoder_deg[ends] - targets)
    arrival_s = _arrival_s(answer, [motion.time_s for motion in motions], pause_s)
    return Check(
        "small_moves",
        "small moves",
        "encoder (deg)",
        Curve(answer.time_s, answer.encoder_deg, None),
        (
            Figure("rest_error_deg", "greatest distance from the target at rest", "deg", float(misses.max()), None),
            Figure("move_time_s", f"longest move of up to {longest_deg:g} deg", "s", arrival_s, None),
        ),
    )


def reversal(config: TableConfig, seed: int) -> Check:
    """Reverse at speed, through the backlash."""
    speed, acceleration, ramp_s = greatest_ramp(config)
    at_s = 0.6 + ramp_s
    motions = [Motion(0.1, far_deg(config), speed, acceleration), Motion(at_s, -far_deg(config), speed, acceleration)]
    answer = emulate(config, motions, at_s + 2.0 * ramp_s + 0.6, seed=seed)
    error = answer.reference_deg - answer.encoder_deg
    window = answer.time_s > at_s - 0.1
    return Check(
        "reversal",
        "reversal through the backlash",
        "encoder behind (deg)",
        Curve(answer.time_s[window], error[window], None),
        (
            Figure(
                "reversal_lag_deg",
                "maximum lag of the encoder in a reversal",
                "deg",
                float(np.abs(error[window]).max()),
                None,
            ),
        ),
    )


def creep(config: TableConfig, seed: int) -> Check:
    """Creep, where stiction and the resolution of the speed have the largest effect.

    The table moves after the gap is crossed.
    """
    speed = _CREEP * config.limits.speed_deg_s
    crossing_s = config.gears.backlash_arcmin / 60.0 / speed
    motions = [Motion(0.1, far_deg(config), speed, 5.0 * speed)]
    answer = emulate(config, motions, 0.1 + 1.5 * crossing_s + _CREEP_S, seed=seed)
    moving = np.flatnonzero(answer.true_deg - answer.true_deg[0] > speed * _SETTLED_CREEP_S)
    ripple = float(answer.true_speed_deg_s[moving[0] :].std()) if len(moving) else float("inf")
    return Check(
        "creep",
        f"creeping at {speed:.3g} deg/s",
        "speed of the table (deg/s)",
        Curve(answer.time_s, answer.true_speed_deg_s, None),
        (Figure("creep_ripple_deg_s", "ripple of the speed at creep", "deg/s", ripple, None),),
    )


def _arrival_s(answer: Answer, starts_s: list[float], pause_s: float) -> float:
    """Return the longest time from a command until the drive is off again."""
    longest = 0.0
    for start_s in starts_s:
        during = (answer.time_s > start_s) & (answer.time_s < start_s + pause_s)
        busy = answer.time_s[during & (answer.motion != IDLE)]
        longest = max(longest, float(busy[-1] - start_s) if len(busy) else 0.0)
    return longest
