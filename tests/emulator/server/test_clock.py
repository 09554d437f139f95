import pytest

from emulator.server.clock import Clock


class Wall:
    """A wall clock that is set by hand."""

    def __init__(self) -> None:
        self.now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


@pytest.fixture
def wall() -> Wall:
    return Wall()


def test_ticks_count_from_zero_at_the_tick_rate(wall: Wall) -> None:
    clock = Clock(tick_hz=1000, wall_s=wall)
    assert clock.now_ticks() == 0.0
    wall.now_s += 0.25
    assert clock.now_ticks() == pytest.approx(250.0)


def test_the_time_scale_multiplies_the_rate(wall: Wall) -> None:
    clock = Clock(tick_hz=1000, time_scale=10.0, wall_s=wall)
    wall.now_s += 0.5
    assert clock.now_ticks() == pytest.approx(5000.0)
    assert clock.wall_s_until(6000.0) == pytest.approx(0.1)


def test_a_new_time_scale_counts_on_without_a_jump(wall: Wall) -> None:
    clock = Clock(tick_hz=1000, wall_s=wall)
    wall.now_s += 1.0
    clock.set_time_scale(100.0)
    assert clock.now_ticks() == pytest.approx(1000.0)
    wall.now_s += 1.0
    assert clock.now_ticks() == pytest.approx(101_000.0)


def test_a_tick_that_has_passed_is_due_at_once(wall: Wall) -> None:
    clock = Clock(tick_hz=1000, wall_s=wall)
    wall.now_s += 1.0
    assert clock.wall_s_until(10.0) == 0.0


def test_the_count_can_be_set(wall: Wall) -> None:
    clock = Clock(tick_hz=1000, wall_s=wall)
    wall.now_s += 5.0
    clock.set_ticks(12.0)
    assert clock.now_ticks() == 12.0


@pytest.mark.parametrize("time_scale", [0.0, -1.0, 1e-4, 1e7, 1e306, float("inf"), float("nan")])
def test_a_time_scale_that_no_clock_can_keep_is_refused(wall: Wall, time_scale: float) -> None:
    with pytest.raises(ValueError, match=r"a number from 0\.001"):
        Clock(tick_hz=1000, wall_s=wall).set_time_scale(time_scale)
