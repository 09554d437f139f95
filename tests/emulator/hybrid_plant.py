"""An oracle for the plant: a hybrid model of the same table, which scipy integrates from event to event."""

import math
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from emulator.config.table_config import TableConfig

Solved = Any  # scipy ships no types


class Mode(NamedTuple):
    """The state of the equations of motion: the flank in contact, and the direction of either side (0: stuck)."""

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
    """The result of a segment of constant voltage and load; speeds and accelerations are at the motor."""

    state: NDArray[np.float64]
    events: int
    peak_speed_rad_s: float
    peak_acceleration_rad_s2: float


class HybridPlant:
    """The plant from a textbook: five states, a mode, and events that end the mode at their exact instant."""

    def __init__(self, config: TableConfig, voltage_V: float, load_torque_Nm: float) -> None:
        self.motor, self.gears, self.friction = config.motor, config.gears, config.friction
        self.motor_inertia = config.motor.rotor_inertia_kg_m2 + config.gears.inertia_kg_m2
        self.table_inertia, self.bearing_Nm = config.table.inertia_kg_m2, config.table.bearing_friction_Nm
        self.static_Nm = config.friction.coulomb_Nm * config.friction.stiction_ratio
        self.half_gap_rad = math.radians(config.gears.backlash_arcmin / 60.0) / 2.0
        self.voltage_V, self.load_Nm = voltage_V, load_torque_Nm

    def torque_ratio(self, contact: int, direction: int) -> float:
        """Return the torque at the motor for a torque at the table; the driven side includes the gears' losses."""
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
        torque = self.motor_torque(state) * (1.0 + 1e-6)  # a torque at the limit breaks away
        return next((way for way in (1, -1) if way * torque > self.holding_torque(contact, way)), 0)

    def mode(self, contact: int, state: NDArray[np.float64]) -> Mode:
        """Return the next mode of the plant from a state."""
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
        """Pass small impulses through the teeth until both sides have one speed."""
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
            state[4] += 1e-9 * (contact - mode.contact)  # clear of a flank that is left, or the event would occur again
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
