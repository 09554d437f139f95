"""The figures of a gain set compared with a second computation that shares no code with them.

scipy discretizes the plant from the constants of the configuration. The loop's response is computed along a dense line
of frequencies. The responses over time come from iterating the closed loop's states tick by tick.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import cont2discrete

from emulator.config.constants import fixed_gains
from emulator.config.table_config import TableConfig, load_config
from emulator.firmware.pid import Gains
from tools.tuning.loop_figures import Loops, loop_figures

Array = NDArray[np.float64]

CONFIG = load_config()
HEAVY = replace(CONFIG, table=replace(CONFIG.table, inertia_kg_m2=3.0))
GEARED_DOWN = replace(CONFIG, gears=replace(CONFIG.gears, ratio=240.0), encoder=replace(CONFIG.encoder, lines=500))
FAST = replace(CONFIG, control=replace(CONFIG.control, tick_hz=4000, speed_window_ticks=20))


class Sampled(NamedTuple):
    """x' = A x + b_duty duty + b_load load of (current, speed, angle), a tick at a time."""

    a: Array
    b: Array  # columns duty, load


def sampled(config: TableConfig, state: str) -> Sampled:
    """The motor by its textbook equations, turning what it turns in a state of the backlash."""
    motor, gears = config.motor, config.gears
    torque = {"driving": 1.0 / gears.efficiency, "overhauling": gears.efficiency, "free": 0.0}[state] / gears.ratio
    inertia = motor.rotor_inertia_kg_m2 + gears.inertia_kg_m2 + config.table.inertia_kg_m2 * torque / gears.ratio
    r, l, k = motor.resistance_ohm, motor.inductance_H, motor.torque_constant_Nm_A  # noqa: E741  # L
    a = np.array([[-r / l, -k / l, 0.0], [k / inertia, -config.friction.viscous_Nm_s / inertia, 0.0], [0.0, 1.0, 0.0]])
    b = np.array([[config.driver.supply_V / l, 0.0], [0.0, -torque / inertia], [0.0, 0.0]])
    discrete = cont2discrete((a, b, np.eye(3), np.zeros((3, 2))), 1.0 / config.control.tick_hz)
    return Sampled(discrete[0], discrete[1])


def real_gains(config: TableConfig, gains: Gains) -> Array:
    """Registers as duty per deg/s: 12, 16 and 12 fraction bits, PWM steps for one count a window."""
    count_deg = 360.0 / (4 * config.encoder.lines * config.gears.ratio)
    unit = (2**config.driver.pwm_bits - 1) * count_deg * config.control.tick_hz / config.control.speed_window_ticks
    answer: Array = np.array([gains.proportional / 4096, gains.integral / 65536, gains.derivative / 4096]) / unit
    return answer


def loop_response(config: TableConfig, state: str, gains: Gains, frequency_hz: Array) -> NDArray[np.complex128]:
    a, b = sampled(config, state)
    window, tick_hz = config.control.speed_window_ticks, config.control.tick_hz
    z = np.exp(2j * np.pi * frequency_hz / tick_hz)
    angle = np.array([np.linalg.solve(at * np.eye(3) - a, b[:, 0])[2] for at in z])
    measured = angle * 180.0 / np.pi / config.gears.ratio * (1.0 - z**-window) * tick_hz / window
    p, i, d = real_gains(config, gains)
    answer: NDArray[np.complex128] = (p + i / (1.0 - 1.0 / z) + d * (1.0 - 1.0 / z)) * measured / z
    return answer


def walked(config: TableConfig, gains: Gains, reference: float, load_Nm: float, seconds: float) -> Array:
    """The speed of the loaded table, in deg/s, after a step at tick 0 of its reference or its load."""
    a, b = sampled(config, "driving")
    window, tick_hz = config.control.speed_window_ticks, config.control.tick_hz
    p, i, d = real_gains(config, gains)
    state, angles_deg = np.zeros(3), [0.0] * (window + 1)
    summed = last = on_bridge = 0.0
    speeds_deg_s = []
    for _ in range(round(seconds * tick_hz)):
        speeds_deg_s.append(float(np.degrees(state[1])) / config.gears.ratio)
        angles_deg.append(float(np.degrees(state[2])) / config.gears.ratio)
        measured = (angles_deg[-1] - angles_deg[-1 - window]) * tick_hz / window
        summed += i * (reference - measured)
        computed = p * (reference - measured) + summed - d * (measured - last)
        state = a @ state + b @ np.array([on_bridge, load_Nm])
        last, on_bridge = measured, computed
    return np.array(speeds_deg_s)


def settled_s(config: TableConfig, deviation: Array, height: float) -> float:
    return float(np.flatnonzero(np.abs(deviation) > 0.1 * height)[-1]) / config.control.tick_hz


CASES = [
    pytest.param(config, name, id=f"{title}-{name}")
    for title, config in (("shipped", CONFIG), ("heavy", HEAVY), ("other gears", GEARED_DOWN), ("4 kHz", FAST))
    for name in ("ramp", "hold")
]


@pytest.mark.parametrize(("config", "name"), CASES)
def test_the_margins_are_those_of_a_walk_along_the_loops_response(config: TableConfig, name: str) -> None:
    gains = fixed_gains(config, getattr(config.gains, name))
    frequency_hz = np.geomspace(0.2, config.control.tick_hz / 2, 20_000)
    peaks, gain_margins_db, phase_margins_deg = [], [], []
    for state in ("driving", "overhauling", "free"):
        loop = loop_response(config, state, gains, frequency_hz)
        phase_deg = np.degrees(np.unwrap(np.angle(loop)))
        peaks.append(1.0 / np.abs(1.0 + loop).min())
        gain_margins_db.append(-20.0 * np.log10(np.abs(loop[np.argmax(phase_deg < -180.0)])))
        phase_margins_deg.append(180.0 + phase_deg[np.argmax(np.abs(loop) < 1.0)])

    found = loop_figures(Loops.of([config], 4096), np.array([gains]))

    assert found.stable[0]
    assert found.sensitivity_peak[0] == pytest.approx(max(peaks), rel=5e-4)
    assert found.gain_margin_db[0] == pytest.approx(min(gain_margins_db), abs=0.05)
    assert found.phase_margin_deg[0] == pytest.approx(min(phase_margins_deg), abs=0.5)


@pytest.mark.parametrize(("config", "name"), CASES)
def test_the_answers_in_time_are_those_of_the_loop_walked_tick_by_tick(config: TableConfig, name: str) -> None:
    gains = fixed_gains(config, getattr(config.gains, name))
    speed, lost = walked(config, gains, 1.0, 0.0, 0.5), -walked(config, gains, 0.0, 1.0, 0.5)
    impulse = np.diff(speed, append=speed[-1])
    frequency_hz = np.arange(0.2, 200.0, 0.2)
    turns = np.outer(frequency_hz, np.arange(1, len(speed) + 1)) / config.control.tick_hz
    tracking = np.abs(np.exp(-2j * np.pi * turns) @ impulse)

    found = loop_figures(Loops.of([config], 4096), np.array([gains]))

    assert found.bandwidth_hz[0] == pytest.approx(frequency_hz[np.argmax(tracking < np.sqrt(0.5))], abs=0.3)
    assert found.overshoot[0] == pytest.approx(max(speed.max() - 1.0, 0.0), abs=1e-3)
    assert found.load_peak_deg_s_Nm[0] == pytest.approx(lost.max(), rel=1e-3)
    settled = max(settled_s(config, speed - 1.0, 1.0), settled_s(config, lost, lost.max()))
    assert found.settling_s[0] == pytest.approx(settled, abs=1.1 / config.control.tick_hz)


def test_the_measured_lag_on_a_ramp_is_that_of_the_loop_walked_tick_by_tick() -> None:
    gains = fixed_gains(CONFIG, CONFIG.gains.ramp)
    answer_to_a_ramp = np.cumsum(walked(CONFIG, gains, 1.0, 0.0, 0.4)) / CONFIG.control.tick_hz
    window_s = CONFIG.control.speed_window_ticks / CONFIG.control.tick_hz  # the measured speed is half a window old

    found = loop_figures(Loops.of([CONFIG], 512), np.array([gains]))

    assert found.ramp_lag_s[0] == pytest.approx(
        0.4 - answer_to_a_ramp[-1] + window_s / 2, abs=1.1 / CONFIG.control.tick_hz
    )


def test_the_bandwidth_does_not_depend_on_the_grid() -> None:
    gains = np.array([fixed_gains(CONFIG, CONFIG.gains.hold)])

    found = [float(loop_figures(Loops.of([CONFIG], size), gains).bandwidth_hz[0]) for size in (256, 512, 4096)]

    assert found == pytest.approx([found[-1]] * 3, rel=0.02)


def test_the_noise_does_not_depend_on_the_grid() -> None:
    """Without a window most of it lies at the highest frequencies, where the grid ends."""
    config = replace(CONFIG, control=replace(CONFIG.control, speed_window_ticks=1))
    gains = np.array([[3000, 20_000, 500]])

    found = [float(loop_figures(Loops.of([config], size), gains).noise_duty[0]) for size in (256, 512, 4096)]

    assert found == pytest.approx([found[-1]] * 3, rel=1e-3)
