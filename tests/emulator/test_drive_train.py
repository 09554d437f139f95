"""The plant against a hybrid model that scipy's stiff solver integrates from event to event, and its invariants."""

import math
import random
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from emulator.config import TableConfig, load_config
from emulator.drive_train import DriveState, DriveTrain, at_standstill, drive_train, step

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


Solved = Any  # scipy ships no types


class Mode(NamedTuple):
    """What the equations of motion depend on: the flank in contact, and which way either side turns (0: stuck)."""

    contact: int
    motor_direction: int
    table_direction: int


class Event:
    """The end of a mode, as scipy asks for it: where a function of the state crosses zero in a direction."""

    terminal = True

    def __init__(self, name: str, value: Callable[[NDArray[np.float64]], float], direction: int) -> None:
        self.name, self.value, self.direction = name, value, direction

    def __call__(self, _time_s: float, state: NDArray[np.float64]) -> float:
        return self.value(state)


class Leg(NamedTuple):
    """What a stretch of constant voltage and load led to; speeds and accelerations as the motor would have them."""

    state: NDArray[np.float64]
    events: int
    peak_speed_rad_s: float
    peak_acceleration_rad_s2: float


class HybridPlant:
    """The plant as a textbook has it: five states, a mode, and events that end the mode at their exact instant."""

    def __init__(self, config: TableConfig, voltage_V: float, load_torque_Nm: float) -> None:
        self.motor, self.gears, self.friction = config.motor, config.gears, config.friction
        self.motor_inertia = config.motor.rotor_inertia_kg_m2 + config.gears.inertia_kg_m2
        self.table_inertia, self.bearing_Nm = config.table.inertia_kg_m2, config.table.bearing_friction_Nm
        self.static_Nm = config.friction.coulomb_Nm * config.friction.stiction_ratio
        self.half_gap_rad = math.radians(config.gears.backlash_arcmin / 60.0) / 2.0
        self.voltage_V, self.load_Nm = voltage_V, load_torque_Nm

    def torque_ratio(self, contact: int, direction: int) -> float:
        """Return the torque at the motor for one at the table; the driven side pays for the gears' losses."""
        efficiency = self.gears.efficiency
        return (1.0 / efficiency if direction == contact else efficiency) / self.gears.ratio

    def motor_torque(self, state: NDArray[np.float64]) -> float:
        return float(self.motor.torque_constant_Nm_A * state[0])

    def accelerations(self, mode: Mode, state: NDArray[np.float64]) -> tuple[float, float]:
        speed, direction = state[1], mode.motor_direction
        stiction = (self.friction.stiction_ratio - 1.0) / (1.0 + (speed / self.friction.stribeck_speed_rad_s) ** 2)
        sliding_Nm = direction * self.friction.coulomb_Nm * (1.0 + stiction) + self.friction.viscous_Nm_s * speed
        driving_Nm = self.motor_torque(state) - sliding_Nm
        if mode.contact == 0:
            table_Nm = mode.table_direction * self.bearing_Nm + self.load_Nm
            return (
                driving_Nm / self.motor_inertia if direction else 0.0,
                -table_Nm / self.table_inertia if mode.table_direction else 0.0,
            )
        if direction == 0:
            return 0.0, 0.0
        share = self.torque_ratio(mode.contact, direction)
        inertia = self.motor_inertia + share * self.table_inertia / self.gears.ratio
        acceleration = (driving_Nm - share * (direction * self.bearing_Nm + self.load_Nm)) / inertia
        return acceleration, acceleration / self.gears.ratio

    def rates(self, mode: Mode, state: NDArray[np.float64]) -> list[float]:
        current, speed, _, table_speed, _ = state
        voltage = self.voltage_V - self.motor.resistance_ohm * current - self.motor.torque_constant_Nm_A * speed
        motor, table = self.accelerations(mode, state)
        return [voltage / self.motor.inductance_H, motor, speed, table, table_speed]

    def tooth_force(self, mode: Mode, state: NDArray[np.float64]) -> float:
        """Return the torque that presses the teeth together, at the table."""
        inertial = self.table_inertia * self.accelerations(mode, state)[1]
        return mode.contact * (inertial + mode.motor_direction * self.bearing_Nm + self.load_Nm)

    def holding_torque(self, contact: int, direction: int) -> float:
        table_Nm = self.bearing_Nm + direction * self.load_Nm
        return self.static_Nm + (self.torque_ratio(contact, direction) * table_Nm if contact else 0.0)

    def free(self, state: NDArray[np.float64]) -> Mode:
        pushed = -np.sign(self.load_Nm) if abs(self.load_Nm) > self.bearing_Nm else 0
        return Mode(0, int(np.sign(state[1])) or self.breakaway(0, state), int(np.sign(state[3]) or pushed))

    def breakaway(self, contact: int, state: NDArray[np.float64]) -> int:
        torque = self.motor_torque(state) * (1.0 + 1e-6)  # what reaches the limit breaks away
        return next((way for way in (1, -1) if way * torque > self.holding_torque(contact, way)), 0)

    def mode(self, contact: int, state: NDArray[np.float64]) -> Mode:
        """Return how the plant goes on from a state."""
        if contact == 0:
            return self.free(state)
        if state[1] != 0.0:
            mode = Mode(contact, *(int(np.sign(state[1])),) * 2)
            return mode if self.tooth_force(mode, state) >= 0.0 else self.free(state)
        pressing_Nm, retreating = (
            contact * self.load_Nm,
            contact * self.motor_torque(state) * (1 + 1e-6) < -self.static_Nm,
        )
        if pressing_Nm < -self.bearing_Nm or (retreating and pressing_Nm <= self.bearing_Nm):
            return self.free(state)
        return Mode(contact, *(self.breakaway(contact, state),) * 2)

    def events(self, mode: Mode) -> list[Event]:
        contact, turning, table_turning = mode
        events: list[Event] = []
        if turning:
            events.append(Event("stop", lambda state: float(state[1]), -turning))
        else:
            events += [Event("break away", partial(self.unheld, contact, way), 1) for way in (1, -1)]
        if contact and turning:
            events.append(Event("part", partial(self.tooth_force, mode), -1))
        elif contact:
            events.append(Event("part", lambda state: contact * self.motor_torque(state) + self.static_Nm, -1))
        else:
            events += [Event(f"meet {flank}", partial(self.beyond, flank), 1) for flank in (1, -1)]
            if table_turning:
                events.append(Event("table stops", lambda state: float(state[3]), -table_turning))
        return events

    def unheld(self, contact: int, way: int, state: NDArray[np.float64]) -> float:
        return way * self.motor_torque(state) - self.holding_torque(contact, way)

    def beyond(self, flank: int, state: NDArray[np.float64]) -> float:
        return float(flank * (state[2] / self.gears.ratio - state[4]) - self.half_gap_rad)

    def after(self, event: str, contact: int, state: NDArray[np.float64]) -> int:
        """Change the state as an event does, and return the contact after it."""
        match event.split():
            case ["stop"]:
                state[1] = 0.0
                state[3] = 0.0 if contact else state[3]
            case ["table", "stops"]:
                state[3] = 0.0
            case ["part"]:
                state[4] += 1e-9 * contact
                return 0
            case ["meet", flank]:
                self.collide(int(flank), state)
                return int(flank)
        return contact

    def collide(self, flank: int, state: NDArray[np.float64]) -> None:
        """Let small impulses pass through the teeth until both sides have one speed."""
        closing = flank * (state[1] - self.gears.ratio * state[3])
        impulse = closing * self.motor_inertia * self.gears.ratio * self.gears.efficiency / 5000.0
        while flank * (state[1] - self.gears.ratio * state[3]) > 0.0:
            state[1] -= flank * self.torque_ratio(flank, int(np.sign(state[1]))) * impulse / self.motor_inertia
            state[3] += flank * impulse / self.table_inertia
        state[3] = state[1] / self.gears.ratio

    def run(self, contact: int, state: NDArray[np.float64], duration_s: float) -> Leg:
        now_s, speeds, accelerations, count = 0.0, [0.0], [0.0], 0
        if contact == 0:
            state[4] += sum(flank * max(self.beyond(flank, state) + 1e-9, 0.0) for flank in (1, -1))  # within the gap
        while now_s < duration_s - 1e-12:
            state[1] = 0.0 if abs(state[1]) < 1e-7 else state[1]
            state[3] = 0.0 if abs(state[3]) < 1e-9 else state[3]
            mode = self.mode(contact, state)
            state[4] += 1e-9 * (contact - mode.contact)  # clear of a flank that is left, or it would be met again
            events = self.events(mode)
            solved = self.solve(mode, events, (now_s, duration_s), state)
            now_s, state, contact = float(solved.t[-1]), solved.y[:, -1].copy(), mode.contact
            for along in solved.y.T:
                motor, table = self.accelerations(mode, along)
                speeds += [abs(along[1]), abs(along[3]) * self.gears.ratio]
                accelerations += [abs(motor), abs(table) * self.gears.ratio]
            for event, instants in zip(events, solved.t_events, strict=True):
                if len(instants):
                    contact, count = self.after(event.name, contact, state), count + 1
            assert count < 200, "the reference chatters"
        return Leg(state, count, max(speeds), max(accelerations))

    def solve(self, mode: Mode, events: list[Event], span_s: tuple[float, float], state: NDArray[np.float64]) -> Solved:
        return solve_ivp(
            lambda _, along: self.rates(mode, along),
            span_s,
            state,
            method="LSODA",
            events=events,
            rtol=1e-8,
            atol=1e-10,
            max_step=2e-3,
        )


def random_table(chance: random.Random, tick_hz: int) -> TableConfig:
    friction = replace(DEFAULT.friction, coulomb_Nm=chance.uniform(0.4e-3, 4e-3))
    backlash_arcmin, efficiency = chance.uniform(2.0, 60.0), chance.uniform(0.3, 1.0)
    return configured(
        replace(DEFAULT, friction=friction), tick_hz, backlash_arcmin=backlash_arcmin, efficiency=efficiency
    )


@pytest.mark.parametrize("tick_hz", [1000, 20_000])
@pytest.mark.parametrize("seed", range(10))
def test_the_plant_is_its_hybrid_model_within_a_tick_an_event(seed: int, tick_hz: int) -> None:
    """Each leg holds a random voltage and load for some time.

    The plant takes a whole tick in one mode, so that an event comes up to a tick late; until then its sides go on at
    their speed and acceleration. Ticks that are twenty times finer come twenty times nearer.
    """
    chance = random.Random(seed)  # noqa: S311  # a test's draw
    config = random_table(chance, tick_hz) if seed else configured(tick_hz=tick_hz)
    train = drive_train(config)
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
    train = drive_train(config)
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
    """Return the voltage at which a table begins to turn that stood with its teeth on the driving flank."""
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
    train, load = drive_train(config), direction * load_torque_Nm
    limit_V = breakaway_V(config, direction, load)
    start = on_flank(train, direction if backlash_arcmin else 1)
    still = held(train, start, 0.999 * direction * limit_V, load, 500)
    moved = held(train, start, 1.001 * direction * limit_V, load, 500)
    assert (still.angle_rad, still.table_angle_rad) == (0.0, start.table_angle_rad)
    assert direction * moved.table_speed_rad_s > 0.0


@pytest.mark.parametrize("backlash_arcmin", [0.0, 10.0])
@pytest.mark.parametrize("direction", [1, -1])
def test_a_load_turns_a_motor_that_is_off_only_through_the_gears_losses(backlash_arcmin: float, direction: int) -> None:
    """Backwards through the gears the load has the efficiency against it: 1.39 Nm, not 0.56, on the default table."""
    config = configured(backlash_arcmin=backlash_arcmin)
    train, gears, friction = drive_train(config), config.gears, config.friction
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
    """At a steady speed the torques balance: a load against the motion weighs more, one that drives the motor less."""
    config = configured(backlash_arcmin=backlash_arcmin)
    train = drive_train(config)
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
    chance, train = random.Random(1), drive_train(configured(backlash_arcmin=0.0))  # noqa: S311  # a test's draw
    state = at_standstill(train, 0.5)
    for _ in range(100):
        state = held(train, state, chance.uniform(-12.0, 12.0), chance.uniform(-1.0, 1.0), chance.randint(1, 30))
        assert state.table_angle_rad == pytest.approx(state.angle_rad / 480.0, abs=1e-15)
        assert state.table_speed_rad_s == pytest.approx(state.speed_rad_s / 480.0, abs=1e-15)


@pytest.mark.parametrize("efficiency", [0.3, 0.6])
def test_a_rigid_chain_brakes_its_table_through_the_gears_losses(efficiency: float) -> None:
    """The limit of a small gap: on the way down the table drives the motor, and its inertia weighs less there."""
    rigid = drive_train(configured(backlash_arcmin=0.0, efficiency=efficiency))
    narrow = drive_train(configured(backlash_arcmin=1e-6, efficiency=efficiency))
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
    train = drive_train(configured(backlash_arcmin=backlash_arcmin))
    state = at_standstill(train, 0.3)
    for voltage_V, load_torque_Nm, ticks in legs:
        for _ in range(ticks):
            state = step(train, state, voltage_V, load_torque_Nm)
            gap_rad = state.angle_rad / train.ratio - state.table_angle_rad
            assert abs(gap_rad) <= train.half_gap_rad + 1e-12
            assert state.contact == 0 or gap_rad == pytest.approx(state.contact * train.half_gap_rad, abs=1e-12)
