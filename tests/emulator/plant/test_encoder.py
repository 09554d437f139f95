import ctypes
import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from emulator.config.constants import drive_constants, encoder_constants
from emulator.config.table_config import load_config
from emulator.plant.drive_train import DriveState, at_standstill, step
from emulator.plant.encoder import Encoder, angle_within_tick, count_at, recounted

DEFAULT = load_config()
COUNT_RAD = 384 / (2.0 * math.pi)
FINE = 100  # steps a tick


def test_the_default_table_gives_512_counts_a_degree() -> None:
    motor_turns = 480 / 360
    assert count_at(encoder_constants(DEFAULT, phase=0.0), motor_turns * 2.0 * math.pi * (1.0 + 1e-9)) == 512


@given(turns=st.integers(-1000, 1000), share=st.floats(0.01, 0.99), phase=st.floats(0.0, 1.0))
def test_the_count_changes_where_an_edge_is_passed(turns: int, share: float, phase: float) -> None:
    """Each count is one interval of the shaft, also below zero: rounded down, not toward zero."""
    angle = (384 * turns + share - phase) / COUNT_RAD
    assert count_at(Encoder(COUNT_RAD, phase), angle) == 384 * turns


@given(st.integers(-(2**40), 2**40))
def test_the_counter_wraps_as_a_32_bit_register(counts: int) -> None:
    assert count_at(Encoder(1.0, 0.5), float(counts)) == ctypes.c_int32(counts).value


@given(
    place=st.integers(-(10**6), 10**6),
    share=st.floats(0.01, 0.99),
    phase=st.floats(0.0, 1.0),
    count=st.integers(-(2**31), 2**31 - 1),
)
def test_a_counter_that_is_set_keeps_the_edges_where_they_are(
    place: int, share: float, phase: float, count: int
) -> None:
    def angle_rad(counts: int) -> float:
        return (place + counts + share - phase) / COUNT_RAD

    set_anew = recounted(Encoder(COUNT_RAD, phase), angle_rad(0), count)
    for moved in (-1, 0, 1):
        assert count_at(set_anew, angle_rad(moved)) == ctypes.c_int32(count + moved).value


def smooth(before: DriveState, after: DriveState) -> bool:
    """Return whether a tick went without an impact, a separation or a stop."""
    return before.contact == after.contact and before.speed_rad_s * after.speed_rad_s > 0.0


@pytest.mark.parametrize("contact", [0, 1])
@pytest.mark.parametrize("backlash_arcmin", [10.0, 600.0])
def test_within_a_tick_the_angle_is_known_to_a_count_at_any_speed(contact: int, backlash_arcmin: float) -> None:
    """Full voltage, reversed at full speed, with and without the table, compared with steps a hundredth as long."""
    config = replace(DEFAULT, gears=replace(DEFAULT.gears, backlash_arcmin=backlash_arcmin))
    train = drive_constants(config)
    fine = drive_constants(replace(config, control=replace(config.control, tick_hz=FINE * config.control.tick_hz)))
    state = at_standstill(train, gap_share=-1.0)
    state = state._replace(contact=contact, table_angle_rad=-contact * train.half_gap_rad)
    worst = 0.0
    for tick in range(150):
        voltage_V = 12.0 if tick < 60 else -12.0
        before, state = state, step(train, state, voltage_V, 0.0)
        within = before
        for part in range(1, FINE + 1):
            within = step(fine, within, voltage_V, 0.0)
            angle = angle_within_tick(before.angle_rad, state.angle_rad, before.speed_rad_s, train.tick_s, part / FINE)
            if smooth(before, state):
                worst = max(worst, abs(angle - within.angle_rad))
    assert 0.0 < worst * COUNT_RAD < 1.0
