"""The noise at the PWM on the emulator and in the linear model: at the worst constant speed, and on a ramp."""

import numpy as np

from emulator.config.constants import fixed_gains
from emulator.config.table_config import TableConfig
from tools.emulated import Array, Motion, emulate
from tools.tuning.check import Check, Curve, Figure, far_deg
from tools.tuning.frequency_response import GRID_SIZE
from tools.tuning.loop_figures import LoopFigures, Loops, loop_figures

_CRUISE_TO, _RAMP_TO = 0.5, 0.5
"""Shares of the maximum speed."""
_RUNS = 4
_SETTLED_S, _MEASURED_S = 0.5, 1.0
_RAMP_S = 1.0


def noise(config: TableConfig, seed: int) -> Check:
    """Turn at the constant speed at which the encoder's counts cause the maximum noise, and on a slow ramp."""
    loops = Loops.of([config], GRID_SIZE)
    ramp, hold = (
        loop_figures(loops, np.array([fixed_gains(config, gains)])) for gains in (config.gains.ramp, config.gains.hold)
    )
    speed = noisy_speed_deg_s(config, hold)
    time_s, duty, steady = _steady(config, speed, seed)
    swept = _on_ramp(config, seed)
    return Check(
        "noise",
        f"noise at {speed:.4g} deg/s",
        "duty (%)",
        Curve(time_s, duty, None),
        (
            Figure(
                "noise_duty_percent",
                f"noise at the PWM at {speed:.4g} deg/s",
                "% duty",
                steady,
                100.0 * float(hold.noise_duty[0]),
            ),
            Figure(
                "ramp_noise_duty_percent",
                "noise at the PWM on a ramp",
                "% duty",
                swept,
                100.0 * float(ramp.ramp_noise_duty[0]),
            ),
        ),
    )


def noisy_speed_deg_s(config: TableConfig, figures: LoopFigures) -> float:
    """Return the maximum speed up to half of the limit with the noise of the worst one."""
    part = float(figures.noisy_count_tick[0])
    most = _CRUISE_TO * config.limits.speed_deg_s * config.counts_per_deg / config.control.tick_hz
    counts = (np.floor(most) - 1.0, np.floor(most))
    alike = [speed for count in counts for speed in (count + part, count + 1.0 - part)]
    speeds = [speed for speed in alike if 0.0 < speed <= most]
    return float(max(speeds, default=part) * config.control.tick_hz / config.counts_per_deg)


def _steady(config: TableConfig, speed_deg_s: float, seed: int) -> tuple[Array, Array, float]:
    """Return a segment of the duty at a constant speed, and the mean of its standard deviation over several starts."""
    acceleration = config.limits.acceleration_deg_s2
    begin_s = 0.1 + speed_deg_s / acceleration + _SETTLED_S
    motions = [Motion(0.1, far_deg(config), speed_deg_s, acceleration)]
    deviations = []
    for start in range(_RUNS):
        answer = emulate(config, motions, begin_s + _MEASURED_S, seed=seed + start)
        late = answer.time_s > begin_s
        deviations.append(float(100.0 * answer.duty[late].std()))
    shown = answer.time_s > begin_s + _MEASURED_S - 0.1
    return answer.time_s[shown], 100.0 * answer.duty[shown], float(np.mean(deviations))


def _on_ramp(config: TableConfig, seed: int) -> float:
    """Return the standard deviation of the duty around its trend on a ramp, the mean over several starts."""
    speed = _RAMP_TO * config.limits.speed_deg_s
    acceleration = min(config.limits.acceleration_deg_s2, speed / _RAMP_S)
    end_s = 0.1 + speed / acceleration
    deviations = []
    for start in range(_RUNS):
        answer = emulate(config, [Motion(0.1, far_deg(config), speed, acceleration)], end_s, seed=seed + start)
        late = answer.time_s > 0.1 + 0.4 * (end_s - 0.1)
        time_s, duty = answer.time_s[late], answer.duty[late]
        deviations.append(float(100.0 * (duty - np.polyval(np.polyfit(time_s, duty, 2), time_s)).std()))
    return float(np.mean(deviations))
