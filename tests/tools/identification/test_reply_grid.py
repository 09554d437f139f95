import numpy as np
import pytest

from tools.emulated import Array
from tools.identification.reply_grid import reply_grid


def ticks(count: int = 4000, seed: int = 1) -> Array:
    """Ticks of a minute's replies."""
    result: Array = np.cumsum(np.random.default_rng(seed).integers(11, 20, count)).astype(np.float64)
    return result


@pytest.mark.parametrize("rate", [0.0, 47e-6, -1e-3, 2e-3])
@pytest.mark.parametrize("phase", [0.0, 0.4, 0.9])
def test_a_clock_of_another_rate_shows_the_same_ticks(rate: float, phase: float) -> None:
    table = ticks()
    clock = table * (1.0 + rate) + phase

    grid = reply_grid(clock, clock)

    assert not grid.fault
    seen = np.round(grid.ticks(clock))
    assert np.unique(seen - table).size == 1


def test_a_clock_that_is_slewed_slowly_shows_the_same_ticks() -> None:
    table = ticks()
    clock = table + 1e-4 * np.clip(table - 20_000.0, 0.0, 20_000.0)

    grid = reply_grid(clock, clock)

    assert not grid.fault
    assert np.unique(np.round(grid.ticks(clock)) - table).size == 1


@pytest.mark.parametrize("late", [0.0, 0.3])
def test_replies_that_are_a_little_late_are_on_the_grid(late: float) -> None:
    table = ticks()
    clock = table + np.random.default_rng(2).uniform(0.0, late, len(table))

    grid = reply_grid(clock, clock)

    assert not grid.fault
    assert np.unique(np.round(grid.ticks(clock)) - table).size == 1


@pytest.mark.parametrize("period", [2, 3, 4, 5, 8, 10, 16, 20])
@pytest.mark.parametrize("jitter", [0.0, 0.1])
def test_a_coarser_grid_is_named(period: int, jitter: float) -> None:
    table = ticks()
    chance = np.random.default_rng(3)
    gathered = np.ceil(table / period) * period + chance.uniform(0.0, jitter, len(table))
    on_the_line = chance.integers(7, 9, len(table))

    assert f"on a grid of {period} ticks" in reply_grid(gathered, gathered - on_the_line).fault


@pytest.mark.parametrize("late", [1.0, 3.0, 15.6])
def test_replies_at_random_times_are_on_no_grid(late: float) -> None:
    clock = ticks() + np.random.default_rng(4).uniform(0.0, late, 4000)

    assert "do not come at the table's ticks" in reply_grid(clock, clock).fault


@pytest.mark.parametrize("jump", [0.3, -0.4, 20.5, -5.35])
@pytest.mark.parametrize("at", [5_000.0, 30_000.0, 41_300.0])
def test_a_jump_of_the_clock_is_seen_in_the_phase(jump: float, at: float) -> None:
    table = ticks()
    clock = table + np.where(table > at, jump, 0.0)

    assert "clock jumps or runs unevenly" in reply_grid(clock, clock).fault


@pytest.mark.parametrize("rate", [3e-4, 5e-4, 1e-3])
def test_a_fast_slew_is_refused(rate: float) -> None:
    table = ticks()
    clock = table + rate * np.clip(table - 20_000.0, 0.0, 20_000.0)

    assert "runs unevenly" in reply_grid(clock, clock).fault
