"""Frequency responses of many speed loops at once: plants, gains and frequencies along the axes of an array.

All use one grid of the discrete Fourier transform, so that an inverse transform gives the response of a closed loop
over time.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm
from threadpoolctl import threadpool_limits

from emulator.config.table_config import TableConfig
from tools.tuning.linear_model import Teeth, load_ratio, motor_system

Complex = NDArray[np.complex128]
Array = NDArray[np.float64]

GRID_SIZE = 1024
"""Number of ticks of a response over time; one bin of the grid is the tick rate over this."""


class PlantResponse(NamedTuple):
    """From duty and load to true and measured speed.

    The response to the duty includes the tick of the PWM's buffer. Shape (..., n).
    """

    measured_by_duty: Complex
    speed_by_duty: Complex
    measured_by_load: Complex
    speed_by_load: Complex


def grid_z(size: int = GRID_SIZE) -> Complex:
    """Return e^(j omega T) of the grid without 0 Hz, where the response of the integrator is infinite."""
    result: Complex = np.exp(2j * np.pi * np.arange(1, size // 2 + 1) / size)
    return result


def grid_hz(config: TableConfig, size: int = GRID_SIZE) -> Array:
    """Return the frequencies of `grid_z`."""
    result: Array = np.arange(1, size // 2 + 1, dtype=np.float64) * (config.control.tick_hz / size)
    return result


def plant_response(configs: list[TableConfig], teeth: Teeth, z: Complex) -> PlantResponse:
    """Return the responses of many plants at once; shape (plants, frequencies).

    It is `linear_model.plant`, vectorized for a thousand plants: motor and load with a zero-order hold by one stacked
    matrix exponential, the window as a sum of delays.
    """
    control = configs[0].control
    held = _exponential(np.array([_held_system(config, teeth) for config in configs]) / control.tick_hz)
    motor, inputs = held[:, :2, :2], held[:, :2, 3:]
    states = _resolvent(motor, z) @ inputs[:, None]  # (plants, frequencies, states, inputs)
    turned = held[:, None, 2:3, :2] @ states + held[:, None, 2:3, 3:]  # the travel in a tick
    window = control.speed_window_ticks
    mean = (z[:, None] ** -np.arange(1, window + 1)).sum(axis=1) * control.tick_hz / window
    table_deg = np.degrees(1.0 / np.array([config.gears.ratio for config in configs]))[:, None]
    speed, measured = table_deg[..., None] * states[..., 1, :], (table_deg * mean)[..., None] * turned[..., 0, :]
    return PlantResponse(measured[..., 0] / z, speed[..., 0] / z, measured[..., 1], speed[..., 1])


def _held_system(config: TableConfig, teeth: Teeth) -> Array:
    """Return the motor's continuous system, extended by its held inputs duty and load, which do not change."""
    a, b = motor_system(config, teeth)
    bordered = np.zeros((5, 5))
    bordered[:3, :3] = a
    bordered[:3, 3:] = b @ np.diag([config.driver.supply_V, load_ratio(config, teeth)])
    return bordered


def _exponential(matrices: Array) -> Array:
    """Return the exponentials of a stack of small matrices.

    If other programs use the processors, the threads of a BLAS wait for each other at each matrix: this turns some
    hundredths of a second into seconds.
    """
    with threadpool_limits(1, "blas"):
        result: Array = expm(matrices)
    return result


def _resolvent(a: Array, z: Complex) -> Complex:
    """Return (z I - A)^-1 of 2x2 matrices by Cramer's rule; shape (plants, frequencies, 2, 2)."""
    trace = a[:, 0, 0] + a[:, 1, 1]
    determinant = a[:, 0, 0] * a[:, 1, 1] - a[:, 0, 1] * a[:, 1, 0]
    adjugate = trace[:, None, None] * np.eye(2) - a
    numerator = z[:, None, None] * np.eye(2) - adjugate[:, None]
    denominator = z**2 - trace[:, None] * z + determinant[:, None]
    result: Complex = numerator / denominator[..., None, None]
    return result
