"""The plant against a hybrid model that scipy's stiff solver integrates from event to event, and its invariants."""

import math
import random
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from emulator.config.constants import drive_constants
from emulator.config.table_config import TableConfig, load_config
from emulator.plant.drive_train import DriveState, DriveTrain, at_standstill, step
from tests.emulator.hybrid_plant import HybridPlant

DEFAULT = load_config()
HUNDREDTH_COUNT_RAD = 0.01 * 2.0 * math.pi / 384.0


def configured(config: TableConfig = DEFAULT, tick_hz: int = 1000, **gears: float) -> TableConfig:
    return replace(config, gears=replace(config.gears, **gears), control=replace(config.control, tick_hz=tick_hz))


def held(train: DriveTrain, state: DriveState, voltage_V: float, load_torque_Nm: float, ticks: int) -> DriveState:
    for _ in range(ticks):
        state = step(train, state, voltage_V, load_torque_Nm)
    return state


def on_flank(train: DriveTrain, contact: int, speed_rad_s: float = 0.0) -> DriveState:
    """Return motor and table turning together, the teeth on a flank."""
    table_angle = -contact * train.half_gap_rad
    return DriveState(0.0, speed_rad_s, 0.0, speed_rad_s / train.ratio, table_angle, contact)


def random_table(chance: random.Random, tick_hz: int) -> TableConfig:
    friction = replace(DEFAULT.friction, coulomb_Nm=chance.uniform(0.4e-3, 4e-3))
    backlash_arcmin, efficiency = chance.uniform(2.0, 60.0), chance.uniform(0.3, 1.0)
    return configured(
        replace(DEFAULT, friction=friction), tick_hz, backlash_arcmin=backlash_arcmin, efficiency=efficiency
    )


@pytest.mark.parametrize("tick_hz", [1000, 20_000])
@pytest.mark.parametrize("seed", range(10))
def test_the_plant_is_its_hybrid_model_within_a_tick_an_event(seed: int, tick_hz: int) -> None:
    """Each leg has a random voltage and load for some time.

    The plant computes a whole tick in one mode, so an event is up to a tick late. Until then its sides continue with
    their speed and acceleration. With ticks that are twenty times finer, the deviation is twenty times smaller.
    """
    chance = random.Random(seed)  # noqa: S311  # a test's draw
    config = random_table(chance, tick_hz) if seed else configured(tick_hz=tick_hz)
    train = drive_constants(config)
    state = at_standstill(train, chance.uniform(-1.0, 1.0))
    for _ in range(15):
        voltage_V = chance.choice([0.0, 1.0, -1.0]) * chance.uniform(0.0, 12.0) * chance.choice([0.1, 1.0])
        load_torque_Nm = chance.choice([0.0, 0.0, chance.uniform(-1.0, 1.0)])
        duration_s = chance.randint(5, 60) * 1e-3
        expected = HybridPlant(config, voltage_V, load_torque_Nm).run(state.contact, np.array(state[:5]), duration_s)
        state = held(train, state, voltage_V, load_torque_Nm, round(duration_s * tick_hz))
        late_rad = (expected.peak_speed_rad_s + expected.peak_acceleration_rad_s2 * duration_s) / tick_hz
        bound_rad = HUNDREDTH_COUNT_RAD + (0.2 + expected.events) * late_rad
        assert state.angle_rad == pytest.approx(expected.state[2], abs=bound_rad)
        assert state.table_angle_rad * train.ratio == pytest.approx(expected.state[4] * train.ratio, abs=bound_rad)


@pytest.mark.parametrize("backlash_arcmin", [0.0, 10.0, 60.0])
@settings(max_examples=25, deadline=None)
@given(
    efficiency=st.floats(0.05, 1.0),
    speed_rad_s=st.floats(-500.0, 500.0),
    table_speed_rad_s=st.floats(-1.0, 1.0),
    current_A=st.floats(-2.0, 2.0),
    gap_share=st.floats(-1.0, 1.0),
)
@example(efficiency=0.25, speed_rad_s=-1.0, table_speed_rad_s=1.0, current_A=-1.0, gap_share=-1.0)
def test_a_shorted_motor_never_gains_energy(
    backlash_arcmin: float,
    efficiency: float,
    speed_rad_s: float,
    table_speed_rad_s: float,
    current_A: float,
    gap_share: float,
) -> None:
    config = configured(backlash_arcmin=backlash_arcmin, efficiency=efficiency)
    train = drive_constants(config)
    state = at_standstill(train, gap_share)._replace(current_A=current_A, speed_rad_s=speed_rad_s)
    state = state._replace(table_speed_rad_s=table_speed_rad_s if backlash_arcmin else speed_rad_s / train.ratio)

    def energy_J(state: DriveState) -> float:
        return 0.5 * (
            config.motor.inductance_H * state.current_A**2
            + train.motor_inertia_kg_m2 * state.speed_rad_s**2
            + train.table_inertia_kg_m2 * state.table_speed_rad_s**2
        )

    for _ in range(150):
        before, state = state, step(train, state, 0.0, 0.0)
        assert energy_J(state) <= energy_J(before) * (1.0 + 1e-12)


def breakaway_V(config: TableConfig, direction: int, load_torque_Nm: float) -> float:
    """Return the voltage at which a table at rest with its teeth on the driving flank starts to turn."""
    motor, gears, friction = config.motor, config.gears, config.friction
    table_Nm = config.table.bearing_friction_Nm + direction * load_torque_Nm
    torque_Nm = friction.coulomb_Nm * friction.stiction_ratio + table_Nm / (gears.ratio * gears.efficiency)
    return torque_Nm / motor.torque_constant_Nm_A * motor.resistance_ohm


@pytest.mark.parametrize("backlash_arcmin", [0.0, 10.0])
@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("load_torque_Nm", [0.0, 0.05, 0.5])
def test_stiction_holds_below_the_static_torque_and_breaks_above(
    backlash_arcmin: float, direction: int, load_torque_Nm: float
) -> None:
    config = configured(backlash_arcmin=backlash_arcmin)
    train, load = drive_constants(config), direction * load_torque_Nm
    limit_V = breakaway_V(config, direction, load)
    start = on_flank(train, direction if backlash_arcmin else 1)
    still = held(train, start, 0.999 * direction * limit_V, load, 500)
    moved = held(train, start, 1.001 * direction * limit_V, load, 500)
    assert (still.angle_rad, still.table_angle_rad) == (0.0, start.table_angle_rad)
    assert direction * moved.table_speed_rad_s > 0.0


@pytest.mark.parametrize("backlash_arcmin", [0.0, 10.0])
@pytest.mark.parametrize("direction", [1, -1])
def test_a_load_turns_a_motor_that_is_off_only_through_the_gears_losses(backlash_arcmin: float, direction: int) -> None:
    """In the backward direction the efficiency acts against the load: 1.39 Nm, not 0.56, on the default table."""
    config = configured(backlash_arcmin=backlash_arcmin)
    train, gears, friction = drive_constants(config), config.gears, config.friction
    static_Nm = friction.coulomb_Nm * friction.stiction_ratio
    limit_Nm = config.table.bearing_friction_Nm + static_Nm * gears.ratio / gears.efficiency
    start = on_flank(train, direction if backlash_arcmin else 1)
    still = held(train, start, 0.0, 0.999 * direction * limit_Nm, 500)
    moved = held(train, start, 0.0, 1.05 * direction * limit_Nm, 500)
    assert (still.angle_rad, still.table_angle_rad) == (0.0, start.table_angle_rad)
    assert direction * moved.table_angle_rad < direction * start.table_angle_rad


@pytest.mark.parametrize("backlash_arcmin", [0.0, 10.0])
@pytest.mark.parametrize(("load_torque_Nm", "weight"), [(0.5, 1.0 / 0.6), (-5.0, 0.6)])
def test_the_motor_pays_or_is_paid_for_a_load_less_the_gears_losses(
    backlash_arcmin: float, load_torque_Nm: float, weight: float
) -> None:
    """At a steady speed the torques balance: a load against the motion counts more, a driving load counts less."""
    config = configured(backlash_arcmin=backlash_arcmin)
    train = drive_constants(config)
    state = held(
        train,
        on_flank(train, 1 if load_torque_Nm > 0.0 or not backlash_arcmin else -1, 200.0),
        6.0,
        load_torque_Nm,
        2000,
    )
    table_Nm = config.table.bearing_friction_Nm + load_torque_Nm
    stribeck = (config.friction.stiction_ratio - 1.0) / (1.0 + (state.speed_rad_s / 5.0) ** 2)
    dissipated_Nm = config.friction.coulomb_Nm * (1.0 + stribeck) + config.friction.viscous_Nm_s * state.speed_rad_s
    torque_Nm = config.motor.torque_constant_Nm_A * state.current_A
    assert state.speed_rad_s > 100.0
    assert torque_Nm == pytest.approx(dissipated_Nm + weight * table_Nm / config.gears.ratio, rel=1e-6)


def test_without_backlash_motor_and_table_turn_as_one() -> None:
    chance, train = random.Random(1), drive_constants(configured(backlash_arcmin=0.0))  # noqa: S311  # a test's draw
    state = at_standstill(train, 0.5)
    for _ in range(100):
        state = held(train, state, chance.uniform(-12.0, 12.0), chance.uniform(-1.0, 1.0), chance.randint(1, 30))
        assert state.table_angle_rad == pytest.approx(state.angle_rad / 480.0, abs=1e-15)
        assert state.table_speed_rad_s == pytest.approx(state.speed_rad_s / 480.0, abs=1e-15)


@pytest.mark.parametrize("efficiency", [0.3, 0.6])
def test_a_rigid_chain_brakes_its_table_through_the_gears_losses(efficiency: float) -> None:
    """The limit of a small gap: during deceleration the table drives the motor, and its inertia counts less."""
    rigid = drive_constants(configured(backlash_arcmin=0.0, efficiency=efficiency))
    narrow = drive_constants(configured(backlash_arcmin=1e-6, efficiency=efficiency))
    stopped = [held(train, on_flank(train, -1, 400.0), 0.0, 0.0, 300) for train in (rigid, narrow)]
    assert [state.speed_rad_s for state in stopped] == [0.0, 0.0]
    assert stopped[0].angle_rad == pytest.approx(stopped[1].angle_rad, rel=0.02)


@settings(max_examples=40, deadline=None)
@given(
    backlash_arcmin=st.floats(0.0, 60.0),
    legs=st.lists(st.tuples(st.floats(-12.0, 12.0), st.floats(-2.0, 2.0), st.integers(1, 40)), max_size=8),
)
def test_the_table_is_at_most_half_the_backlash_from_where_the_motor_says(
    backlash_arcmin: float, legs: list[tuple[float, float, int]]
) -> None:
    train = drive_constants(configured(backlash_arcmin=backlash_arcmin))
    state = at_standstill(train, 0.3)
    for voltage_V, load_torque_Nm, ticks in legs:
        for _ in range(ticks):
            state = step(train, state, voltage_V, load_torque_Nm)
            gap_rad = state.angle_rad / train.ratio - state.table_angle_rad
            assert abs(gap_rad) <= train.half_gap_rad + 1e-12
            assert state.contact == 0 or gap_rad == pytest.approx(state.contact * train.half_gap_rad, abs=1e-12)


@given(speed_rad_s=st.floats(1e-4, 0.02), load_Nm=st.floats(0.0, 2.0), direction=st.sampled_from([-1, 1]))
def test_a_table_that_coasts_within_the_gap_stops_after_the_way_that_its_friction_takes(
    speed_rad_s: float, load_Nm: float, direction: int
) -> None:
    """v^2 / 2a, to the last tick: the deceleration is constant, and the tick in which it stops is a part of one."""
    train = drive_constants(configured(backlash_arcmin=3000.0))
    deceleration = (train.bearing_friction_Nm + load_Nm) / train.table_inertia_kg_m2
    state = at_standstill(train, 0.0)._replace(table_speed_rad_s=direction * speed_rad_s)
    begun_rad = state.table_angle_rad
    while state.table_speed_rad_s != 0.0:
        state = step(train, state, 0.0, direction * load_Nm)
        assert state.contact == 0
    way_rad = direction * (state.table_angle_rad - begun_rad)
    assert way_rad == pytest.approx(speed_rad_s**2 / (2.0 * deceleration), rel=1e-9)
