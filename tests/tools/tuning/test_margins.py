import control
import numpy as np
import pytest
from numpy.testing import assert_allclose

from emulator.config.constants import fixed_gains
from emulator.config.table_config import load_config
from emulator.firmware.pid import Gains
from tools.tuning.frequency_response import PlantResponse, grid_hz, grid_z, plant_response
from tools.tuning.linear_model import Teeth, duty_gains, plant, quantization_noise
from tools.tuning.loop import closed_loop
from tools.tuning.loop_figures import step_answer
from tools.tuning.margins import Margins, controller, margins, noise_duty

CONFIG = load_config()
SETS = {"ramp": CONFIG.gains.ramp, "hold": CONFIG.gains.hold}


def scaled(gains: Gains, factor: float) -> Gains:
    return Gains(*(round(factor * gain) for gain in gains))


def loop_transfer(teeth: Teeth, gains: Gains) -> control.TransferFunction:
    """The loop by textbook algebra, as a rational function of z."""
    proportional, integral, derivative = duty_gains(CONFIG, gains)
    tick_s = 1.0 / CONFIG.control.tick_hz
    z = control.tf([1, 0], [1], tick_s)
    pid = proportional + integral * z / (z - 1) + derivative * (z - 1) / z
    return pid * control.tf(plant(CONFIG, teeth)[1, 0])


def grid_margins(teeth: Teeth, gains: Gains) -> Margins:
    z = grid_z()
    regulator = controller(duty_gains(CONFIG, gains), z)
    return margins((regulator.by_measured * plant_response([CONFIG], teeth, z).measured_by_duty)[0], grid_hz(CONFIG))


@pytest.mark.parametrize("name", SETS)
@pytest.mark.parametrize("teeth", Teeth)
def test_margins_agree_with_a_brute_force_walk_along_the_loop(name: str, teeth: Teeth) -> None:
    gains = fixed_gains(CONFIG, SETS[name])
    frequency_hz = np.arange(0.05, 500.0, 0.05)
    loop = loop_transfer(teeth, gains)(np.exp(2j * np.pi * frequency_hz / CONFIG.control.tick_hz))
    phase_deg = np.degrees(np.unwrap(np.angle(loop)))
    at_crossover = np.argmax(np.abs(loop) < 1.0)
    at_half_turn = np.argmax(phase_deg < -180.0)

    found = grid_margins(teeth, gains)

    assert found.stable
    assert_allclose(found.sensitivity_peak, 1.0 / np.abs(1.0 + loop).min(), rtol=2e-3)
    assert_allclose(found.gain_margin_db, -20.0 * np.log10(np.abs(loop[at_half_turn])), atol=0.05)
    assert_allclose(found.phase_margin_deg, 180.0 + phase_deg[at_crossover], atol=0.5)
    assert_allclose(found.crossover_hz, frequency_hz[at_crossover], rtol=0.01)


@pytest.mark.parametrize("factor", [0.5, 1.0, 1.6])
@pytest.mark.parametrize("size", [256, 512, 1024])
def test_the_peak_of_the_sensitivity_does_not_depend_on_the_grid(factor: float, size: int) -> None:
    """Between the grid's frequencies: 1e-4 of a search in steps of a hundredth of a hertz."""
    gains = scaled(fixed_gains(CONFIG, CONFIG.gains.hold), factor)
    z = grid_z(size)
    regulator = controller(duty_gains(CONFIG, gains), z)
    for teeth in Teeth:
        loop = (regulator.by_measured * plant_response([CONFIG], teeth, z).measured_by_duty)[0]
        turn = np.exp(2j * np.pi * np.arange(1.0, 200.0, 0.01) / CONFIG.control.tick_hz)

        found = margins(loop, grid_hz(CONFIG, size)).sensitivity_peak

        assert_allclose(found, 1.0 / np.abs(1.0 + loop_transfer(teeth, gains)(turn)).min(), rtol=1e-4)


@pytest.mark.parametrize("name", SETS)
@pytest.mark.parametrize("teeth", Teeth)
def test_the_shipped_gains_stay_out_of_the_circle_of_ms(name: str, teeth: Teeth) -> None:
    turn = np.exp(2j * np.pi * np.arange(0.02, 500.0, 0.02) / CONFIG.control.tick_hz)

    distance = np.abs(1.0 + loop_transfer(teeth, fixed_gains(CONFIG, SETS[name]))(turn))

    assert distance.min() >= 1.0 / 1.7


@pytest.mark.parametrize("factor", [0.1, 1.0, 2.0, 2.6, 3.0, 4.0, 10.0])
@pytest.mark.parametrize("teeth", Teeth)
def test_a_loop_is_called_stable_when_all_its_poles_are_within_the_unit_circle(teeth: Teeth, factor: float) -> None:
    gains = scaled(fixed_gains(CONFIG, CONFIG.gains.hold), factor)
    poles = control.poles(closed_loop(CONFIG, teeth, gains))

    assert bool(grid_margins(teeth, gains).stable) == bool(np.abs(poles).max() < 1.0)


def test_the_noise_at_the_pwm_is_that_of_the_answers_to_each_count() -> None:
    """In the opposite direction: the variance is the sum over the squared response to one count, tick by tick."""
    gains, z = fixed_gains(CONFIG, CONFIG.gains.ramp), grid_z()
    count_deg, _ = quantization_noise(CONFIG)
    window = CONFIG.control.speed_window_ticks
    window_s = window / CONFIG.control.tick_hz
    system = plant(CONFIG, Teeth.FREE)
    proportional, integral, derivative = duty_gains(CONFIG, gains)
    state, summed, last, squares = np.zeros(system.nstates), 0.0, 0.0, 0.0
    for tick in range(1000):
        rounding = (float(tick == 0) - float(tick == window)) * count_deg / window_s
        measured = float(system.C[1] @ state) + rounding
        summed -= integral * measured
        duty = -proportional * measured + summed - derivative * (measured - last)
        last = measured
        squares += duty**2
        state = system.A @ state + system.B[:, 0] * duty

    plants = PlantResponse(*(response[0] for response in plant_response([CONFIG], Teeth.FREE, z)))
    found = noise_duty(controller(duty_gains(CONFIG, gains), z), plants, count_deg, window_s, window, z)

    assert_allclose(found, np.sqrt(squares), rtol=1e-3)


def test_a_step_answer_by_fourier_is_the_one_in_time() -> None:
    z, gains = grid_z(512), fixed_gains(CONFIG, CONFIG.gains.hold)
    loop = closed_loop(CONFIG, Teeth.DRIVING, gains)
    response = loop(z)[0, 0]

    in_time = control.step_response(loop, np.arange(512) / CONFIG.control.tick_hz).outputs[0, 0]

    assert_allclose(step_answer(response, 1.0), in_time, atol=1e-6)
