"""The effect of a fault of drive or encoder on the motion, and the reaction of the firmware."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from emulator.config.table_config import load_config
from emulator.faults.fault import fault_from
from emulator.table.table import Table
from emulator.table.tick import step
from tests.emulator.fault_bench import Bench


def test_a_stalled_motor_is_switched_off_and_the_next_motion_starts_where_it_stands(bench: Bench) -> None:
    bench.client.set_speed(20)
    bench.client.move_to(40)
    bench.client.clock.sleep_s(1.0)
    bench.inject("stall")
    bench.client.clock.sleep_s(1.0)
    status = bench.table.status()
    assert (status.state, status.duty, status.speed_deg_s) == ("stalled", 0.0, 0.0)
    assert abs(status.current_A) < 1e-9
    bench.table.clear_faults()
    held = bench.client.position_deg()
    bench.client.move_by(5)
    bench.client.wait_until_at(held + 5, tolerance_deg=0.15)


def test_an_extra_load_costs_current_and_ends_with_its_time() -> None:
    currents = []
    for torque_Nm in (0.0, 0.3):
        bench = Bench()
        bench.inject("extra-load", torque_Nm=torque_Nm, for_s=1.5)
        bench.move(40, 1.4)
        currents.append(bench.table.status().current_A)
        bench.client.wait_until_at(40)
    # 0.3 Nm over the gears, with their losses, over the motor's torque constant.
    assert currents[1] - currents[0] == pytest.approx(0.3 / (480 * 0.6) / 23.4e-3, rel=0.2)


def test_with_a_sagging_supply_the_table_cannot_keep_its_speed(bench: Bench) -> None:
    bench.inject("supply-sag", supply_V=3.0)
    bench.move(60, 2.5)
    status = bench.table.status()
    assert status.duty == pytest.approx(1.0)
    assert 5.0 < status.speed_deg_s < 15.0  # a quarter of the no-load speed of 61 deg/s, less the friction's share


def test_a_stuck_bridge_drives_on_after_the_target(bench: Bench) -> None:
    bench.inject("stuck-pwm", duty=0.3, for_s=2.0)
    bench.client.clock.sleep_s(1.0)
    assert bench.table.status().speed_deg_s > 10.0
    bench.client.clock.sleep_s(2.0)
    assert bench.table.status().speed_deg_s == 0.0
    assert bench.client.position_deg() > 10.0


@pytest.mark.parametrize("direction", [1, -1])
def test_a_one_sided_bridge_cannot_go_the_other_way(direction: int) -> None:
    bench = Bench()
    bench.inject("one-sided", direction=direction)
    bench.move(-10 * direction)
    assert abs(bench.client.position_deg()) < 0.2
    bench.move(10 * direction)
    assert abs(bench.client.position_deg()) > 9.0


def test_lost_counts_turn_the_table_too_far_for_good(bench: Bench) -> None:
    bench.inject("lost-counts", probability=0.1)
    bench.move(20)
    bench.table.clear_faults()
    status = bench.table.status()
    assert bench.client.position_deg() == 20.0
    assert status.true_deg == pytest.approx(20 / 0.9, rel=0.02)
    before = status.true_deg - status.encoder_deg
    bench.move(10)
    after = bench.table.status()
    assert after.true_deg - after.encoder_deg == pytest.approx(before, abs=0.2)


def test_a_dead_encoder_ends_in_a_stall(bench: Bench) -> None:
    bench.inject("dead-encoder")
    bench.move(20)
    status = bench.table.status()
    assert (status.state, status.encoder_deg) == ("stalled", 0.0)
    assert status.true_deg > 5.0


def test_a_swapped_encoder_makes_the_table_run_away(bench: Bench) -> None:
    bench.inject("swapped-encoder")
    bench.move(20, 2.0)
    status = bench.table.status()
    assert status.true_deg == pytest.approx(-status.encoder_deg, abs=0.3)
    assert status.true_deg > 40.0


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32), ticks=st.integers(1, 300), target=st.integers(-50, 50))
def test_a_tick_of_a_fault_without_force_is_that_of_a_sound_table(seed: int, ticks: int, target: int) -> None:
    table = Table(load_config().with_serial(baud=0), seed)
    table.receive(b"P %d\r" % target)
    table.advance(ticks)
    constants, state = table.snapshot().constants, table.snapshot().state
    table.inject(fault_from("extra-load", {"torque_Nm": 0.0}))
    table.advance(1)
    assert table.snapshot().state == step(constants, state, 0.0)
