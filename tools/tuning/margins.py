"""Robustness and performance of a speed loop, from its frequency response.

    L = C G              loop, C the regulator, G the plant with its delay
    S = 1 / (1 + L)      sensitivity; Ms its peak: 1/Ms is the least distance of L from -1

All functions work along the last axis, the frequencies of `frequency_response.grid_z`.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tools.tuning.frequency_response import Array, Complex, PlantResponse

_PLACES = np.linspace(0.0, 4.0, 101)
_QUARTIC = np.stack(  # Lagrange's polynomials of the points 0, 1, 2, 3, 4
    [
        np.prod([(_PLACES - other) / (point - other) for other in range(5) if other != point], axis=0)
        for point in range(5)
    ],
    axis=-1,
)


class Controller(NamedTuple):
    """The PID's responses: to the reference, and to the measured speed (the derivative acts only on the latter)."""

    by_reference: Complex
    by_measured: Complex


class Margins(NamedTuple):
    """Robustness of a loop; if `stable` is false, the others have no meaning."""

    stable: NDArray[np.bool_]
    sensitivity_peak: Array
    gain_margin_db: Array
    phase_margin_deg: Array
    crossover_hz: Array


def controller(gains: Array, z: Complex) -> Controller:
    """Return the PID's responses; gains (..., 3) in duty per deg/s as of `linear_model.duty_gains`."""
    proportional, integral, derivative = (gains[..., [column]] for column in range(3))
    difference = 1.0 - 1.0 / z
    by_reference = proportional + integral / difference
    return Controller(by_reference, by_reference + derivative * difference)


def margins(loop: Complex, frequency_hz: Array) -> Margins:
    """Return the margins of loops L of stable plants with an integrating PID; shape (..., frequencies)."""
    distance = 1.0 + loop
    # Nyquist: from -90 deg at 0 Hz, because of the integrator, 1 + L must turn by +90 deg and not around the origin.
    turned = np.angle(distance[..., 0]) + np.angle(distance[..., 1:] / distance[..., :-1]).sum(axis=-1)
    return Margins(
        np.abs(turned) < np.pi / 2,
        1.0 / _least_size(distance),
        _gain_margin_db(loop),
        *_phase_margin(loop, frequency_hz),
    )


def _least_size(curve: Complex) -> Array:
    """Return the minimum distance of a curve from the origin, on the quartic near the nearest point."""
    nearest = np.abs(curve).argmin(axis=-1)
    first = np.clip(nearest - 2, 0, curve.shape[-1] - 5)
    points = np.take_along_axis(curve, first[..., None] + np.arange(5), axis=-1)
    result: Array = np.abs(np.einsum("...p,qp->...q", points, _QUARTIC)).min(axis=-1)
    return result


def _gain_margin_db(loop: Complex) -> Array:
    """The distance from the origin at which L crosses the negative real axis, linear between two frequencies."""
    a, b = loop[..., :-1], loop[..., 1:]
    share = _crossing(a.imag, b.imag)
    real = a.real + share * (b.real - a.real)
    crosses = (a.imag * b.imag < 0.0) & (real < 0.0)
    greatest = np.max(np.where(crosses, -real, 1e-6), axis=-1)
    result: Array = -20.0 * np.log10(greatest)
    return result


def _phase_margin(loop: Complex, frequency_hz: Array) -> tuple[Array, Array]:
    """Return the minimum angle from -180 deg where |L| crosses 1, and the last such frequency."""
    size = np.log(np.abs(loop))
    a, b = size[..., :-1], size[..., 1:]
    crosses = a * b < 0.0
    share = _crossing(a, b)
    turn = np.angle(loop[..., 1:] / loop[..., :-1])
    angle = np.abs(np.angle(-loop[..., :-1] * np.exp(1j * share * turn)))
    margin_deg = np.degrees(np.min(np.where(crosses, angle, np.pi), axis=-1))
    low, high = frequency_hz[:-1], frequency_hz[1:]
    crossover_hz = np.max(np.where(crosses, low + share * (high - low), 0.0), axis=-1)
    return margin_deg, crossover_hz


def _crossing(a: Array, b: Array) -> Array:
    """Return the share of the distance from a to b at which the line through them is 0."""
    change = b - a
    return np.clip(-a / np.where(change == 0.0, 1.0, change), 0.0, 1.0)


def noise_power(control: Controller, plant: PlantResponse, window_s: float, window_ticks: int, z: Complex) -> Array:
    """Return the squared response of the duty to an error of the position, which acts at both ends of the window."""
    speed_by_position = (1.0 - z**-window_ticks) / window_s
    result: Array = (
        np.abs(control.by_measured / (1.0 + control.by_measured * plant.measured_by_duty) * speed_by_position) ** 2
    )
    return result


def noise_duty(
    control: Controller, plant: PlantResponse, count_deg: float, window_s: float, window_ticks: int, z: Complex
) -> Array:
    """Return the standard deviation of the duty caused by the rounding of the position to counts.

    The errors are assumed to be white, as on a ramp, which passes all speeds. Parseval: the variance is the mean over
    all frequencies of the squared response. All but the last of the grid also represent their mirror image.
    """
    power = noise_power(control, plant, window_s, window_ticks, z)
    variance = (power.sum(axis=-1) - 0.5 * power[..., -1]) / len(z)
    result: Array = count_deg * np.sqrt(variance)
    return result
