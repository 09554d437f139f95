"""The controller without its plant: the states of a motion, the protection, and the speed estimate."""

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from emulator.config.constants import firmware_constants
from emulator.config.table_config import load_config
from emulator.firmware.controller import (
    IDLE,
    MOVING,
    SETTLING,
    STALLED,
    FirmwareState,
    begin_motion,
    distance_to,
    position_error,
    power_on,
    step,
)
from emulator.firmware.pid import HOLD, RAMP
from emulator.firmware.profiler import Profile, Reference
from emulator.int32 import INT32_MAX

CONFIG = load_config()
FIRMWARE = firmware_constants(CONFIG)
BITS = FIRMWARE.motion_bits
ONE = 1 << BITS
PROFILE = Profile.of(round(20 * 0.512 * ONE), round(50 * 0.000512 * ONE))

Shaft = Callable[[FirmwareState], int]
"""The position of the encoder after a tick, for a controller's state before it."""


def blocked(state: FirmwareState) -> int:
    return state.counts[-1]


def obedient(state: FirmwareState) -> int:
    return state.reference.position_count


def free(state: FirmwareState) -> int:
    """A motor whose speed is its duty: full duty is 20 counts a tick."""
    return state.counts[-1] + round(state.pid.duty / 1023 * 20)


def woken(count: int = 0) -> FirmwareState:
    return power_on(FIRMWARE, PROFILE, count)


def run(state: FirmwareState, shaft: Shaft, ticks: int) -> list[FirmwareState]:
    states = []
    for _ in range(ticks):
        state = step(FIRMWARE, state, shaft(state))
        states.append(state)
    return states


def motions(states: list[FirmwareState]) -> list[int]:
    """Return the motion states in their order, each once."""
    found = [states[0].motion]
    for state in states:
        if state.motion != found[-1]:
            found.append(state.motion)
    return found


def test_it_wakes_at_rest_where_the_encoder_stands_and_stays_off() -> None:
    states = run(woken(77), blocked, 20)
    assert {state.motion for state in states} == {IDLE}
    assert {state.pid.duty for state in states} == {0}
    assert states[-1].reference == Reference(77, 0, 0, 0, 0)


def test_a_motion_moves_settles_and_rests() -> None:
    states = run(begin_motion(woken(), PROFILE, 5 * 512 * ONE, BITS), free, 3000)
    assert motions(states) == [MOVING, SETTLING, IDLE]
    assert states[-1].reference == Reference(5 * 512, 0, 0, 0, 0)
    assert abs(states[-1].counts[-1] - 5 * 512) <= CONFIG.settling.arrival_count + 1
    assert states[-1].pid.duty == 0


def test_ramps_have_their_own_gain_set() -> None:
    """Two ramps with a constant speed between them; section 2.1 of the paper."""
    states = run(begin_motion(woken(), PROFILE, 20 * 512 * ONE, BITS), obedient, 2000)
    moving = [state for state in states if state.motion == MOVING]
    for before, after in pairwise(moving):
        assert after.pid.gain_set == (HOLD if before.reference.speed == after.reference.speed else RAMP)
    assert {state.pid.gain_set for state in moving} == {HOLD, RAMP}


def test_the_motion_ends_when_the_encoder_has_stayed_at_the_target() -> None:
    settling = begin_motion(woken(), PROFILE, 0, BITS)
    settling = settling._replace(motion=SETTLING, reference=Reference(100, 0, 0, 0, 0), counts=(90,) * 8)
    ticks = FIRMWARE.arrival_ticks
    states = run(settling, lambda _: 99, ticks)
    assert motions(states) == [SETTLING, IDLE]
    assert [state.motion for state in states].index(IDLE) == ticks - 1


def test_a_table_that_is_pushed_away_from_its_target_is_brought_back_first() -> None:
    settling = begin_motion(woken(), PROFILE, 0, BITS)
    settling = settling._replace(motion=SETTLING, reference=Reference(100, 0, 0, 0, 0), counts=(100,) * 8)
    arriving = run(settling, lambda _: 100, FIRMWARE.arrival_ticks - 1)[-1]
    pushed = step(FIRMWARE, arriving, 102)
    assert pushed.motion == SETTLING
    assert pushed.pid.integral < arriving.pid.integral
    again = run(pushed, lambda _: 101, FIRMWARE.arrival_ticks)
    assert [state.motion for state in again].index(IDLE) == FIRMWARE.arrival_ticks - 1


def test_a_table_that_creeps_too_long_is_switched_off() -> None:
    settling = begin_motion(woken(), PROFILE, 0, BITS)._replace(motion=SETTLING, reference=Reference(5000, 0, 0, 0, 0))
    ticks = FIRMWARE.settling_ticks
    states = run(settling, lambda state: state.counts[-1] ^ 1, ticks)  # it never stands, and never gets nearer
    assert motions(states) == [SETTLING, STALLED]
    assert [state.motion for state in states].index(STALLED) == ticks - 1


def test_a_motor_that_stands_while_driven_is_switched_off_and_the_state_says_so() -> None:
    states = run(begin_motion(woken(), PROFILE, 30 * 512 * ONE, BITS), blocked, 1000)
    assert motions(states) == [MOVING, STALLED]
    driven = [state for state in states if state.motion == MOVING and state.pid.duty >= FIRMWARE.stall_duty]
    assert len(driven) == FIRMWARE.stall_ticks - 1
    last = states[-1]
    assert (last.pid.duty, last.pid.integral, last.reference) == (0, 0, Reference(0, 0, 0, 0, 0))


def test_one_count_is_enough_to_show_that_it_turns() -> None:
    """A count every 200 ms, faster than the protection's time: the motor is slow, but does not stand."""
    ticks = iter(range(10_000))
    moving = begin_motion(woken(), PROFILE, 30 * 512 * ONE, BITS)
    states = run(moving, lambda _: next(ticks) // 200, 1000)
    assert motions(states) == [MOVING]


def test_the_next_motion_after_a_stall_starts_where_the_table_stands() -> None:
    stalled = run(begin_motion(woken(40), PROFILE, 30 * 512 * ONE, BITS), blocked, 1000)[-1]
    assert (stalled.motion, stalled.reference.position_count) == (STALLED, 40)
    states = run(begin_motion(stalled, PROFILE, 512 * ONE, BITS), free, 3000)
    assert motions(states) == [MOVING, SETTLING, IDLE]
    assert states[-1].reference.position_count == 552


def test_a_pre_emption_keeps_reference_speed_and_regulator() -> None:
    moving = run(begin_motion(woken(), PROFILE, 30 * 512 * ONE, BITS), free, 300)[-1]
    changed = begin_motion(moving, PROFILE, -512 * ONE, BITS)
    assert changed.reference[:3] == moving.reference[:3]
    assert changed.pid == moving.pid
    assert changed.counts == moving.counts


@given(st.lists(st.integers(-30, 30), max_size=30), st.integers(-INT32_MAX, INT32_MAX))
def test_the_speed_is_the_counts_difference_over_the_window(moves: list[int], start: int) -> None:
    """Also past the counter's limit, and while the drive is off."""
    state, count, history = woken(start), start, [0] * 8
    for move in moves:
        count = (count + move + 2**31) % 2**32 - 2**31
        state = step(FIRMWARE, state, count)
        history.append(move)
        assert state.pid.measured == sum(history[-8:])


@given(st.integers(-INT32_MAX, INT32_MAX), st.integers(0, ONE - 1), st.integers(-1000, 1000))
def test_the_position_error_is_that_of_the_nearest_count_and_knows_the_counters_end(
    position: int, fraction: int, error: int
) -> None:
    count = (position - error + 2**31) % 2**32 - 2**31
    assert position_error(Reference(position, fraction, 0, 0, 0), count, BITS) == error + (fraction >= ONE // 2)


def test_an_absolute_target_counts_from_the_reference_with_its_fraction() -> None:
    assert distance_to(Reference(10, ONE // 2, 3, 4, 5), 12 * ONE, BITS) == ONE + ONE // 2


@pytest.mark.parametrize("seconds", [1e-9, 0.25])
def test_the_protection_waits_at_least_a_tick(seconds: float) -> None:
    protection = replace(CONFIG.protection, stall_time_s=seconds, settling_time_s=seconds)
    parameters = firmware_constants(replace(CONFIG, protection=protection))
    assert parameters.stall_ticks == parameters.settling_ticks == max(1, seconds * 1000)
