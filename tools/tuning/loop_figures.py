"""Figures of the linear loop for judging a gain set, for many plants or many gain sets at once."""

from collections.abc import Sequence
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from emulator.config.table_config import TableConfig
from tools.tuning.frequency_response import Array, Complex, PlantResponse, grid_hz, grid_z, plant_response
from tools.tuning.linear_model import Teeth, duty_gains, quantization_noise, speed_gain_deg_s
from tools.tuning.margins import controller, margins, noise_duty, noise_power
from tools.tuning.speed_noise import steady_noise

SETTLED_SHARE = 0.1


class Loops(NamedTuple):
    """The plants of one or many tables in each state of the backlash, on one grid of frequencies."""

    config: TableConfig  # the table of their common controller
    z: Complex
    frequency_hz: Array
    plants: dict[Teeth, PlantResponse]
    speed_gain_deg_s: Array

    @classmethod
    def of(cls, configs: list[TableConfig], grid_size: int) -> Self:
        """Return the loops of tables that differ only in their plants."""
        z = grid_z(grid_size)
        return cls(
            configs[0],
            z,
            grid_hz(configs[0], grid_size),
            {teeth: plant_response(configs, teeth, z) for teeth in Teeth},
            np.array([speed_gain_deg_s(config) for config in configs]),
        )


class LoopFigures(NamedTuple):
    """Figures of loops, each an array; the margins and the noise are the worst over all states of the backlash."""

    stable: NDArray[np.bool_]
    sensitivity_peak: Array
    gain_margin_db: Array
    phase_margin_deg: Array
    noise_duty: Array  # standard deviation of the duty from the rounding of the position, at the worst constant speed
    noisy_count_tick: (
        Array  # that speed, as a fraction of a count per tick; a whole count minus this fraction has the same noise
    )
    ramp_noise_duty: Array  # the same standard deviation on a ramp
    bandwidth_hz: Array  # -3 dB of the speed over the reference, loaded
    overshoot: Array  # of the speed after a step of the reference, loaded; 0.1 is 10 %
    settling_s: Array  # from a step of the reference or the load until the speed stays within a tenth of it
    ramp_lag_s: Array  # speed error over acceleration on a ramp
    load_peak_deg_s_Nm: Array  # maximum loss of speed after a step of the load


def loop_figures(loops: Loops, registers: Array) -> LoopFigures:
    """Return the figures of gain sets given as the firmware's register values, shape (n, 3) or (1, 3)."""
    config, z = loops.config, loops.z
    gains = duty_gains(config, registers)
    regulator = controller(gains, z)
    window_ticks, tick_hz = config.control.speed_window_ticks, config.control.tick_hz
    per_state = [
        margins(regulator.by_measured * plant.measured_by_duty, loops.frequency_hz) for plant in loops.plants.values()
    ]
    count_deg, _ = quantization_noise(config)
    window_s, count_tick = window_ticks / tick_hz, config.limits.speed_deg_s * config.counts_per_deg / tick_hz
    noises = [noise_duty(regulator, plant, count_deg, window_s, window_ticks, z) for plant in loops.plants.values()]
    steady = [
        steady_noise(noise_power(regulator, plant, window_s, window_ticks, z), count_tick)
        for plant in loops.plants.values()
    ]
    worst = np.argmax([noise for noise, _ in steady], axis=0)[None]
    plant = loops.plants[Teeth.DRIVING]
    sensitivity = 1.0 / (1.0 + regulator.by_measured * plant.measured_by_duty)
    tracking = plant.speed_by_duty * regulator.by_reference * sensitivity
    rejection = plant.speed_by_load - plant.speed_by_duty * regulator.by_measured * sensitivity * plant.measured_by_load
    speed, lost = step_answer(tracking, 1.0), step_answer(rejection, 0.0)
    load_peak = -lost.min(axis=-1)
    settling = np.maximum(settling_ticks(speed - 1.0, 1.0), settling_ticks(lost, load_peak[..., None]))
    return LoopFigures(
        stable=np.all([state.stable for state in per_state], axis=0),
        sensitivity_peak=np.max([state.sensitivity_peak for state in per_state], axis=0),
        gain_margin_db=np.min([state.gain_margin_db for state in per_state], axis=0),
        phase_margin_deg=np.min([state.phase_margin_deg for state in per_state], axis=0),
        noise_duty=np.max([noise for noise, _ in steady], axis=0) / config.counts_per_deg,
        noisy_count_tick=np.take_along_axis(np.array([speed for _, speed in steady]), worst, axis=0)[0],
        ramp_noise_duty=np.max(noises, axis=0),
        bandwidth_hz=_bandwidth_hz(tracking, loops.frequency_hz),
        overshoot=np.maximum(speed.max(axis=-1) - 1.0, 0.0),
        settling_s=settling / tick_hz,
        ramp_lag_s=1.0 / (gains[..., 1] * tick_hz * loops.speed_gain_deg_s),
        load_peak_deg_s_Nm=load_peak,
    )


def step_answer(response: Complex, at_rest: float) -> Array:
    """Return the response of a stable system to a unit step, by the inverse Fourier transform of its response.

    Args:
        response: the response on `grid_z`; its impulse response must end within the grid's length.
        at_rest: its value at 0 Hz, the final value of the step response.
    """
    whole = np.concatenate([np.full((*response.shape[:-1], 1), at_rest, dtype=complex), response], axis=-1)
    answer: Array = np.cumsum(np.fft.irfft(whole, axis=-1), axis=-1)
    return answer


def joined(parts: Sequence[LoopFigures]) -> LoopFigures:
    """Return the figures of several batches as those of one."""
    return LoopFigures(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def _bandwidth_hz(tracking: Complex, frequency_hz: Array) -> Array:
    """Return the frequency at which the absolute response, which is 1 at 0 Hz, first falls below -3 dB."""
    size = np.log(np.abs(np.concatenate([np.ones((*tracking.shape[:-1], 1)), tracking], axis=-1)) * np.sqrt(2.0))
    frequency_hz = np.concatenate([[0.0], frequency_hz])
    below = size < 0.0
    first = np.where(below.any(axis=-1), np.argmax(below, axis=-1), size.shape[-1] - 1)
    before, after = (np.take_along_axis(size, at[..., None], axis=-1)[..., 0] for at in (first - 1, first))
    share = np.clip(before / np.where(before == after, np.inf, before - after), 0.0, 1.0)
    result: Array = frequency_hz[first - 1] + share * (frequency_hz[first] - frequency_hz[first - 1])
    return result


def settling_ticks(deviation: Array, height: Array | float) -> Array:
    """Return the last tick at which the deviation is outside a tenth of the height."""
    outside = np.abs(deviation) > SETTLED_SHARE * height
    result: Array = np.where(outside.any(axis=-1), outside.shape[-1] - 1 - np.argmax(outside[..., ::-1], axis=-1), 0)
    return result.astype(np.float64)
