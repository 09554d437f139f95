"""The DC motor, and its exact zero-order-hold discretization.

    L di/dt = v - R i - K w          the electrical side, current i, voltage v
    J dw/dt = K i - B w - m          the mechanical side, speed w, resisting torque m
      da/dt = w                      the shaft's angle a

Voltage and torque are constant over a tick, so the state at its end is a linear function of the state at its start.
The electrical time constant (0.11 ms) is far below the tick: an Euler step at 1 ms would diverge.
"""

from operator import mul
from typing import NamedTuple

Matrix = list[list[float]]


class Motor(NamedTuple):
    """The constants of the motor, from its datasheet, with the viscous friction at its shaft."""

    resistance_ohm: float
    inductance_H: float
    torque_constant_Nm_A: float
    rotor_inertia_kg_m2: float
    viscous_Nm_s: float


class MotorStep(NamedTuple):
    """The state one tick later: one row each for current, speed, angle; columns current, speed, voltage, torque."""

    current_current: float
    current_speed: float
    current_voltage: float
    current_torque: float
    speed_current: float
    speed_speed: float
    speed_voltage: float
    speed_torque: float
    angle_current: float
    angle_speed: float
    angle_voltage: float
    angle_torque: float


def discretize(motor: Motor, inertia_kg_m2: float, tick_s: float) -> MotorStep:
    """Return the exact step of a motor with the given inertia, including its rotor, for inputs held for a tick."""
    r, l, k, _, b = motor  # noqa: E741  # L
    j = inertia_kg_m2
    system = [  # d/dt of current, speed, angle, voltage, torque
        [-r / l, -k / l, 0.0, 1.0 / l, 0.0],
        [k / j, -b / j, 0.0, 0.0, -1.0 / j],
        [0.0, 1.0, 0.0, 0.0, 0.0],
        [0.0, 0.0, 0.0, 0.0, 0.0],
        [0.0, 0.0, 0.0, 0.0, 0.0],
    ]
    step = matrix_exponential([[entry * tick_s for entry in row] for row in system])
    return MotorStep(*(step[row][column] for row in range(3) for column in (0, 1, 3, 4)))


def matrix_exponential(matrix: Matrix) -> Matrix:
    """Return the exponential of a small square matrix.

    The matrix is halved until it is small, then Taylor's series is summed and squared back.

    Implemented here instead of with scipy, so that the emulator starts without it.
    """
    size = len(matrix)
    norm = max(sum(abs(entry) for entry in row) for row in matrix)
    halvings = 0
    while norm > 0.25:
        norm /= 2
        halvings += 1
    scaled = [[entry / 2**halvings for entry in row] for row in matrix]
    term = [[float(row == column) for column in range(size)] for row in range(size)]
    total = [list(row) for row in term]
    for order in range(1, 14):
        term = [[entry / order for entry in row] for row in _product(term, scaled)]
        total = [[a + b for a, b in zip(*rows, strict=True)] for rows in zip(total, term, strict=True)]
    for _ in range(halvings):
        total = _product(total, total)
    return total


def _product(a: Matrix, b: Matrix) -> Matrix:
    columns = list(zip(*b, strict=True))
    nothing = [0.0] * len(columns)
    return [[sum(map(mul, row, column)) for column in columns] if any(row) else nothing for row in a]
