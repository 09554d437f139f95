"""The exact discretization of the motor against scipy: its matrix exponential, and its stiff solvers."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from emulator.plant.motor import Motor, discretize, matrix_exponential

RE_25 = {"resistance_ohm": 2.18, "inductance_H": 0.238e-3, "torque_constant_Nm_A": 23.4e-3}


def decades(least: float, most: float) -> st.SearchStrategy[float]:
    return st.floats(math.log10(least), math.log10(most)).map(lambda exponent: float(10.0**exponent))


motors = st.fixed_dictionaries(
    {
        "resistance_ohm": decades(0.1, 100.0),
        "inductance_H": decades(1e-5, 1e-1),  # with little inertia the motor rings: complex eigenvalues
        "torque_constant_Nm_A": decades(1e-3, 0.3),
        "inertia_kg_m2": decades(1e-7, 1e-4),
        "viscous_Nm_s": decades(1e-8, 1e-4),
        "tick_s": decades(1e-5, 1e-2),
    }
)


def step_matrix(motor: dict[str, float]) -> NDArray[np.float64]:
    values = dict(motor)
    inertia_kg_m2, tick_s = values.pop("inertia_kg_m2"), values.pop("tick_s")
    return np.array(discretize(Motor(rotor_inertia_kg_m2=inertia_kg_m2, **values), inertia_kg_m2, tick_s)).reshape(3, 4)


def test_columns_are_the_response_to_each_state_and_input() -> None:
    motor = RE_25 | {"inertia_kg_m2": 1.18e-6, "viscous_Nm_s": 1e-6, "tick_s": 1e-3}
    current, speed, voltage, torque = np.eye(4)
    decay = step_matrix(motor) @ speed
    assert decay[0] < 0.0, "back-EMF drives a current against the motion"
    assert 0.0 < decay[1] < 1.0, "which brakes it"
    assert 0.0 < decay[2] < motor["tick_s"], "over the way it makes"
    assert (step_matrix(motor) @ voltage > 0.0).all()
    assert (step_matrix(motor) @ torque)[1] < 0.0
    assert (step_matrix(motor) @ current)[1] > 0.0


@settings(max_examples=60, deadline=None)
@given(
    motor=motors, start=st.tuples(*[st.floats(-5, 5), st.floats(-500, 500), st.floats(-12, 12), st.floats(-0.1, 0.1)])
)
def test_a_tick_is_what_a_stiff_solver_integrates(
    motor: dict[str, float], start: tuple[float, float, float, float]
) -> None:
    current_A, speed_rad_s, voltage_V, torque_Nm = start
    k, j = motor["torque_constant_Nm_A"], motor["inertia_kg_m2"]

    def rates(_time_s: float, state: NDArray[np.float64]) -> list[float]:
        i, w, _ = state
        return [
            (voltage_V - motor["resistance_ohm"] * i - k * w) / motor["inductance_H"],
            (k * i - motor["viscous_Nm_s"] * w - torque_Nm) / j,
            w,
        ]

    solved = solve_ivp(
        rates, (0.0, motor["tick_s"]), [current_A, speed_rad_s, 0.0], method="LSODA", rtol=1e-10, atol=1e-12
    )
    scale = np.abs(solved.y).max(axis=1)
    assert step_matrix(motor) @ start == pytest.approx(solved.y[:, -1], abs=1e-9 + 1e-6 * float(scale.max()), rel=1e-6)


@settings(max_examples=200, deadline=None)
@given(st.lists(st.floats(-1.0, 1.0), min_size=16, max_size=16), decades(1e-3, 30.0))
def test_the_matrix_exponential_is_scipys(entries: list[float], scale: float) -> None:
    matrix = np.array(entries).reshape(4, 4) * scale
    expected = expm(matrix)
    assert np.array(matrix_exponential(matrix.tolist())) == pytest.approx(
        expected, rel=1e-9, abs=1e-12 * float(np.linalg.norm(expected))
    )


def test_the_exponential_of_nothing_is_the_identity() -> None:
    assert matrix_exponential([[0.0, 0.0], [0.0, 0.0]]) == [[1.0, 0.0], [0.0, 1.0]]


def test_steady_speed_is_the_datasheets() -> None:
    """4860 rpm without load, 12 V less the no-load current's drop over the back-EMF constant."""
    motor = RE_25 | {"inertia_kg_m2": 1.03e-6, "viscous_Nm_s": 0.0, "tick_s": 1e-3}
    no_load_torque_Nm = 26e-3 * RE_25["torque_constant_Nm_A"]
    state = np.zeros(3)
    for _ in range(1000):
        state = step_matrix(motor) @ [*state[:2], 12.0, no_load_torque_Nm]
    assert state[0] == pytest.approx(26e-3)
    assert state[1] * 60.0 / (2.0 * math.pi) == pytest.approx(4860, rel=0.01)
