"""The noise at a constant speed, compared with the rounding of a position tick by tick."""

from dataclasses import replace

import numpy as np
import pytest

from emulator.config.table_config import load_config
from tools.tuning.noise_check import noise
from tools.tuning.speed_noise import steady_noise

COUNT = 512


def rounding_noise(answer: np.ndarray, count_tick: float) -> float:
    """Standard deviation of a filter's output whose input is the rounding error of a position at a constant speed."""
    ticks = np.arange(1 << 15)
    position = 0.123 + ticks * (count_tick + 1e-7)
    error = np.floor(position) - position + 0.5
    return float(np.convolve(error, answer)[len(answer) : len(ticks)].std())


@pytest.mark.parametrize("window", [1, 8])
def test_the_worst_speed_and_its_noise_are_those_of_a_search_in_time(window: int) -> None:
    answer = np.zeros(64)
    answer[0], answer[window] = 1.0, -1.0
    answer = np.convolve(answer, 0.8 ** np.arange(40))
    power = np.abs(np.fft.rfft(answer, 2 * COUNT)[1:]) ** 2

    deviation, count_tick = steady_noise(power, 20.0)

    speeds = np.linspace(0.01, 0.5, 99)
    assert deviation == pytest.approx(max(rounding_noise(answer, speed) for speed in speeds), rel=0.05)
    assert rounding_noise(answer, float(count_tick)) == pytest.approx(float(deviation), rel=0.03)


def test_a_table_that_makes_less_than_half_a_count_a_tick_has_no_faster_speed_to_be_noisy_at() -> None:
    power = np.linspace(0.0, 1.0, COUNT)  # the higher the frequency, the louder

    assert steady_noise(power, 20.0)[1] > 0.4
    assert steady_noise(power, 0.1)[1] <= 0.1


def test_the_emulator_is_as_noisy_as_predicted_at_the_worst_speed_and_on_a_ramp() -> None:
    config = load_config()
    for table in (config, replace(config, encoder=replace(config.encoder, lines=40))):
        for figure in noise(table, 0).figures:
            assert figure.emulator == pytest.approx(figure.model, rel=0.1)
