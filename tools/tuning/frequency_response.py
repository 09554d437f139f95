"""Frequency responses of many speed loops at once: plants, candidate gains and frequencies along the axes of an array.

All on one grid of the discrete Fourier transform, so that a closed loop's answer in time is one inverse transform away.
"""

from typing import NamedTuple

import control
import numpy as np
from numpy.typing import NDArray

from emulator.config import TableConfig
from tools.tuning.linear_model import Teeth, plant

Complex = NDArray[np.complex128]
Array = NDArray[np.float64]

GRID_SIZE = 1024
"""Ticks of an answer in time; one bin of the grid is the tick rate over this."""


class PlantResponse(NamedTuple):
    """From duty and load to true and measured speed; one tick of the PWM's buffer is in the duty's. Shape (..., n)."""

    measured_by_duty: Complex
    speed_by_duty: Complex
    measured_by_load: Complex
    speed_by_load: Complex


def grid_z(size: int = GRID_SIZE) -> Complex:
    """Return e^(j omega T) of the grid without 0 Hz, where the integrator has no finite answer."""
    return np.exp(2j * np.pi * np.arange(1, size // 2 + 1) / size)


def grid_hz(config: TableConfig, size: int = GRID_SIZE) -> Array:
    """Return the frequencies of `grid_z`."""
    return np.arange(1, size // 2 + 1) * (config.control.tick_hz / size)


def plant_response(configs: list[TableConfig], teeth: Teeth, z: Complex) -> PlantResponse:
    """Return the responses of many plants at once; shape (plants, frequencies)."""
    systems = [plant(config, teeth) for config in configs]
    responses = np.array([_response(system, z) for system in systems])
    buffered = responses[..., 0] / z
    return PlantResponse(buffered[:, 1], buffered[:, 0], responses[:, 1, :, 1], responses[:, 0, :, 1])


def _response(system: control.StateSpace, z: Complex) -> Complex:
    """Return the response (outputs, frequencies, inputs); the window's delays are solved by hand, being a chain."""
    motor, angle = slice(0, 2), 2
    inputs = np.broadcast_to(system.B[motor].astype(complex), (len(z), 2, 2))
    states = np.linalg.solve(z[:, None, None] * np.eye(2) - system.A[motor, motor], inputs)
    made = (system.A[angle, motor] @ states + system.B[angle]) / z[:, None]
    window = system.nstates - 2
    mean = (z[:, None] ** -np.arange(window)).sum(axis=1)
    speed = system.C[0, motor] @ states
    measured = system.C[1, angle] * mean[:, None] * made
    return np.array([speed, measured])
